#include "ref/model/model.hpp"

namespace dqw {

void Sums::reset(int parameters, int channel_count, int block_count)
{
    channels = channel_count;
    blocks = block_count;
    of.assign(static_cast<std::size_t>(block_count * channel_count),
              Eigen::MatrixXd::Zero(parameters + 1, parameters + 1));
}

Eigen::MatrixXd Sums::total(int channel) const
{
    Eigen::MatrixXd sum = at(0, channel);
    for (int b = 1; b < blocks; ++b) sum += at(b, channel);
    return sum;
}

}  // namespace dqw
