// What a model's own error may hide behind its inputs: deviations that no scatter of blocks shows.
#ifndef DQW_REF_MODEL_COHERENT_HPP
#define DQW_REF_MODEL_COHERENT_HPP

#include "ref/model/model.hpp"

namespace dqw {

/// What a lasting volt makes of the innovations of a channel.
struct LastingVolt {
    Eigen::VectorXd weight;  ///< the rows over the innovations' variance, times the square of what it makes of one
    /// part of it that a row leaves to the next: what lasts n rows makes 1 - kept^n of it
    Eigen::VectorXd kept;
};

/// (E111), (E164). By how much an error as large as what lasts of the reported residual may move each column of `at`,
/// and how far what goes with single rows has moved it, as a standard deviation; zero where there is neither.
/// `information`: J'J over the innovations' variance.
Eigen::VectorXd coherent_deviations(const Model& model, const Point& at, const Eigen::MatrixXd& information,
                                    const LastingVolt& volt);

/// Of a dynamic log's innovation form. `variance`: of each axis' innovations, A^2.
LastingVolt lasting_volt(const std::vector<Log>& logs, const Point& at, const Eigen::VectorXd& variance, double rows);

}  // namespace dqw
#endif
