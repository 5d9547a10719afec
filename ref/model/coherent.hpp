// What a model's own error may hide behind its inputs: deviations that no scatter of blocks shows.
#ifndef DQW_REF_MODEL_COHERENT_HPP
#define DQW_REF_MODEL_COHERENT_HPP

#include "ref/model/model.hpp"

namespace dqw {

/// (E111), (E164). By how much an error as large as what lasts of the reported residual may move each column of `at`,
/// and how far what goes with single rows has moved it, as a standard deviation; zero where there is neither.
/// `information`: J'J over the innovations' variance; `weight`: of each channel, the rows over that variance, times the
/// square of what a lasting volt makes of an innovation.
Eigen::VectorXd coherent_deviations(const Model& model, const Point& at, const Eigen::MatrixXd& information,
                                    const Eigen::VectorXd& weight);

/// That weight of a dynamic log's innovation form. `variance`: of each axis' innovations, A^2.
Eigen::VectorXd coherent_weight(const std::vector<Log>& logs, const Point& at, const Eigen::VectorXd& variance,
                                double rows);

}  // namespace dqw
#endif
