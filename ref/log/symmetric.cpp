#include "ref/log/symmetric.hpp"

#include <Eigen/Eigenvalues>
#include <Eigen/QR>

namespace dqw {

Symmetric::Symmetric(const Eigen::MatrixXd& m)
{
    const Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd> solver(m);
    values_ = solver.eigenvalues(), vectors_ = solver.eigenvectors();
}

Eigen::MatrixXd pseudo_inverse(const Eigen::MatrixXd& m) { return m.completeOrthogonalDecomposition().pseudoInverse(); }

Eigen::VectorXd least_squares(const Eigen::MatrixXd& a, const Eigen::VectorXd& y)
{
    return a.completeOrthogonalDecomposition().solve(y);
}

}  // namespace dqw
