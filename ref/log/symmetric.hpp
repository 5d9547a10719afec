// Dense decompositions behind plain functions: Eigen's templates for them are compiled once.
#ifndef DQW_REF_LOG_SYMMETRIC_HPP
#define DQW_REF_LOG_SYMMETRIC_HPP

#include <Eigen/Core>

namespace dqw {

/// Eigenvalues, ascending, and unit eigenvectors of a symmetric matrix.
class Symmetric {
public:
    explicit Symmetric(const Eigen::MatrixXd& m);
    const Eigen::VectorXd& eigenvalues() const { return values_; }
    const Eigen::MatrixXd& eigenvectors() const { return vectors_; }

private:
    Eigen::VectorXd values_;
    Eigen::MatrixXd vectors_;
};

/// Moore and Penrose's inverse.
Eigen::MatrixXd pseudo_inverse(const Eigen::MatrixXd& m);

/// x of least norm that leaves least of y - a x.
Eigen::VectorXd least_squares(const Eigen::MatrixXd& a, const Eigen::VectorXd& y);

}  // namespace dqw
#endif
