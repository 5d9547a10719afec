// What an open circuit's model may lack in every row alike: deviations that no scatter of rows shows.
#ifndef DQW_REF_MODEL_OPEN_CIRCUIT_HPP
#define DQW_REF_MODEL_OPEN_CIRCUIT_HPP

#include "ref/model/model.hpp"

namespace dqw {

/// Settled points in which no current flows.
bool is_open_circuit(const std::vector<Log>& logs);

/// Settled points of a machine whose terminals are shorted, of whose current the size alone is known: volts and i_d are
/// zero throughout, which no current that flows leaves so.
bool is_short_circuit(const Log& log);

/// Whether a magnet's temperature is in the model and no thermometer is on the magnet.
bool is_beside_magnet(const Point& at);

/// (E160), (E161). By how much each column of `at` may be off where rows depart by a part of their voltage, neighbours
/// in speed alike, and the magnet is not as warm as the sensor that stands for it. A block of the plan is a row.
Eigen::VectorXd open_circuit_deviations(const Model& model, const Point& at);

}  // namespace dqw
#endif
