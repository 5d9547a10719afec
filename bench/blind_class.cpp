#include "blind_class.hpp"

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <map>
#include <stdexcept>

#include "blind_effect.hpp"

namespace blind {
namespace {

using Column = Eigen::VectorXd;

/// In nats: below 2 standard deviations nobody can tell, from 5 on everybody should.
constexpr double kSame = 2.0, kTold = 12.5;
/// Of the true one's own size: laws are linearised, sizes up to a tenth of a radian and of an inductance.
constexpr double kLinear = 0.03;
/// Of the largest size: how much is simulated to see the direction.
constexpr double kProbe = 0.3;

/// White noise of voltages and speed, and currents' noise that comes back a row later: a moving average of two rows.
class Whitener {
public:
    explicit Whitener(const std::vector<double>& noise) : half_(noise.size() / 2)
    {
        for (std::size_t axis = 0; axis < 2; ++axis) {
            const std::size_t n = half_ ? half_ : noise.size();
            double own = 0, next = 0;
            for (std::size_t k = 0; k < half_; ++k) {
                const double e = noise[axis * half_ + k];
                own += e * e;
                if (k + 1 < half_) next += e * noise[axis * half_ + k + 1];
            }
            own_[axis] = std::max(own / static_cast<double>(n), 1e-300);
            next_[axis] = std::clamp(next / static_cast<double>(n), -0.4999 * own_[axis], 0.4999 * own_[axis]);
        }
    }

    /// The Cholesky factor of two diagonals, inverted.
    Column operator()(const std::vector<double>& e) const
    {
        if (e.size() < 2 * half_) throw std::runtime_error("residuals of unlike logs");
        Column y(static_cast<Eigen::Index>(2 * half_));
        for (std::size_t axis = 0; axis < 2; ++axis) {
            double diagonal = std::sqrt(own_[axis]), last = 0;
            for (std::size_t k = 0; k < half_; ++k) {
                const double below = k ? next_[axis] / diagonal : 0;
                if (k) diagonal = std::sqrt(own_[axis] - below * below);
                last = (e[axis * half_ + k] - below * last) / diagonal;
                y(static_cast<Eigen::Index>(axis * half_ + k)) = last;
            }
        }
        return y;
    }

private:
    std::size_t half_;
    double own_[2] = {}, next_[2] = {};
};

/// Directions of an effect whose law is linear, and ways to draw what is not.
struct Family {
    std::vector<std::size_t> linear;  ///< places in Setup::shape whose quarter turns span it
    std::size_t variants = 1;         ///< of shape[0]: a width, a time constant, an order
    bool one_sign = false;
};

Family family_of(const std::string& name)
{
    if (name == "dead_time") return {{}, 3, false};
    if (name == "winding_temperature" || name == "magnet_temperature") return {{}, 2, true};
    if (name == "iron_loss" || name == "skin_effect" || name == "delay" || name == "coulomb_friction")
        return {{}, 1, true};
    // How often in a turn: each a direction of its own.
    if (name == "encoder_eccentricity") return {{2}, 2, false};
    if (name == "stribeck_friction" || name == "direction_asymmetry") return {{}, 2, false};
    if (name == "flux_harmonics") return {{2, 1}, 1, false};
    if (name == "saturation" || name == "cross_saturation") return {{1}, 1, false};
    if (name == "cogging_torque") return {{2}, 3, false};
    if (name == "angle_offset" || name == "load_torque") return {};
    return {{2}, 1, false};
}

/// The log with each row's phase currents of an instant `part` of a period earlier, while the last row's voltage acts, to
/// first order: the simulator samples later alone, and a filter looks like it.
dqw::Log earlier(const dqw::Log& log, const dqw::PlainModel& m, double part)
{
    dqw::Log out = log;
    for (std::size_t k = 1; k < log.rows(); ++k) {
        const double w = m.pole_pairs * log.w_m_rad_s[k], turn = 0.5 * w * log.dt_s, c = std::cos(turn),
                     s = std::sin(turn), by = part * log.dt_s, i_d = log.i_d_A[k], i_q = log.i_q_A[k],
                     v_d = c * log.v_d_V[k - 1] + s * log.v_q_V[k - 1],
                     v_q = c * log.v_q_V[k - 1] - s * log.v_d_V[k - 1];
        out.i_d_A[k] -= by * ((v_d - m.R_ohm * i_d + w * m.Lq_H * i_q) / m.Ld_H - w * i_q);
        out.i_q_A[k] -= by * ((v_q - m.R_ohm * i_q - w * (m.Ld_H * i_d + m.psi_Wb)) / m.Lq_H + w * i_d);
    }
    return out;
}

class Classes {
public:
    Classes(const Setup& setup, const std::vector<Drawn>& drawn) : setup_(setup), whiten_(noise_of(drawn))
    {
        const dqw::PlainModel truth = truth_of(setup_);
        ideal_ = residuals(log_of(setup_, setup_.scenario, false), truth, rows());
        dqw_sim_scenario x = with(setup_, drawn);
        const dqw::Log log = log_of(setup_, x, false);
        const std::vector<double> at = residuals(log, truth, rows());
        whole_ = whiten_(less(at, ideal_));
        for (const auto field : fields_of(setup_.regime)) {
            dqw::PlainModel moved = truth;
            moved.*field += 1e-3 * std::max(std::abs(truth.*field), 1e-12);
            plain_.push_back(whiten_(less(residuals(log, moved, rows()), at)));
        }
        if (setup_.regime != dqw::Regime::dynamic) return;
        const double part = kProbe * most_of("sample_shift", setup_);
        earlier_ = {whiten_(less(residuals(earlier(log, truth, part), truth, rows()), at))};
    }

    /// The drawn one itself, alone.
    Column alone(const Drawn& d) { return whiten_(less(residuals_with(setup_, d.name, d.size), ideal_)); }

    /// What is left of all that was drawn, squared, with the plain model, `others` and any directions of `name`.
    double least(const std::vector<Column>& others, const std::string& name)
    {
        const Family family = family_of(name);
        double best = rest(others, {}, false);
        for (std::size_t v = 0; v < family.variants; ++v) {
            const std::vector<Column>& directions = directions_of(name, family, v);
            best = std::min(best, rest(others, directions, family.one_sign));
        }
        if (name == "sample_shift") best = std::min(best, rest(others, earlier_, false));
        return best;
    }

    double rest(const std::vector<Column>& others, const std::vector<Column>& directions, bool one_sign) const
    {
        std::vector<const Column*> columns;
        for (const Column& c : plain_) columns.push_back(&c);
        for (const Column& c : others) columns.push_back(&c);
        for (const Column& c : directions) columns.push_back(&c);
        Eigen::MatrixXd a(whole_.size(), static_cast<Eigen::Index>(columns.size()));
        for (std::size_t k = 0; k < columns.size(); ++k) {
            const double norm = columns[k]->norm();
            a.col(static_cast<Eigen::Index>(k)) = *columns[k] / (norm > 0 ? norm : 1.0);
        }
        const Eigen::MatrixXd gram = a.transpose() * a;
        const Eigen::VectorXd size = gram.completeOrthogonalDecomposition().solve(a.transpose() * whole_);
        // Not this one: it would have to be below nothing, or larger than any machine's.
        for (std::size_t k = 0; k < directions.size(); ++k) {
            const double share = size(size.size() - 1 - static_cast<Eigen::Index>(k)) /
                                 std::max(directions[directions.size() - 1 - k].norm(), 1e-300) * kProbe;
            if ((one_sign && share < 0) || std::abs(share) > 2) return rest(others, {}, false);
        }
        return (whole_ - a * size).squaredNorm();
    }

private:
    std::size_t rows() const { return setup_.regime == dqw::Regime::dynamic ? 1 : 0; }

    static dqw_sim_scenario with(const Setup& s, const std::vector<Drawn>& drawn)
    {
        dqw_sim_scenario x = s.scenario;
        for (const Drawn& d : drawn) apply(d.name, d.size, s, x);
        return x;
    }

    /// The loops do not see the log's noise: both runs go the same way.
    std::vector<double> noise_of(const std::vector<Drawn>& drawn) const
    {
        const dqw_sim_scenario x = with(setup_, drawn);
        const dqw::PlainModel truth = truth_of(setup_);
        return less(residuals(log_of(setup_, x, true), truth, rows()),
                    residuals(log_of(setup_, x, false), truth, rows()));
    }

    static std::vector<double> less(std::vector<double> a, const std::vector<double>& b)
    {
        if (a.size() != b.size()) throw std::runtime_error("residuals of unlike logs");
        for (std::size_t k = 0; k < a.size(); ++k) a[k] -= b[k];
        return a;
    }

    std::vector<double> residuals_with(const Setup& s, const std::string& name, double size) const
    {
        dqw_sim_scenario x = s.scenario;
        apply(name, size, s, x);
        return residuals(log_of(s, x, false), truth_of(s), rows());
    }

    const std::vector<Column>& directions_of(const std::string& name, const Family& family, std::size_t variant)
    {
        std::vector<Column>& found = known_[name + std::to_string(variant)];
        if (!found.empty()) return found;
        const double size = kProbe * most_of(name, setup_);
        for (std::size_t turn = 0; turn < (std::size_t{1} << family.linear.size()); ++turn) {
            Setup s = setup_;
            s.shape[3] = 1;
            if (family.variants > 1)
                s.shape[0] = static_cast<double>(variant) / static_cast<double>(family.variants - 1);
            // A dead time's direction is that of the plain law; its sign is free.
            if (name == "dead_time") s.shape[4] = 1, s.shape[5] = 0;
            for (std::size_t k = 0; k < family.linear.size(); ++k) s.shape[family.linear[k]] = turn >> k & 1 ? 0.25 : 0;
            found.push_back(whiten_(less(residuals_with(s, name, size), ideal_)));
            // It comes with a saturation of any size.
            if (name == "cross_saturation") {
                s.shape[1] = turn ? 1 : 0;
                found.push_back(whiten_(less(residuals_with(s, "saturation", size), ideal_)));
            }
        }
        return found;
    }

    Setup setup_;
    Whitener whiten_;
    std::vector<double> ideal_;
    Column whole_;
    std::vector<Column> plain_, earlier_;
    std::map<std::string, std::vector<Column>> known_;
};

}  // namespace

void find_classes(const Setup& setup, std::vector<Drawn>& drawn)
{
    const Setup s = on_mean_plant(setup);
    Classes classes(s, drawn);
    std::vector<std::string> names = effects_for(s);
    std::sort(names.begin(), names.end());
    names.erase(std::unique(names.begin(), names.end()), names.end());
    std::vector<Column> alone;
    for (const Drawn& d : drawn) alone.push_back(classes.alone(d));
    const double own = classes.rest(alone, {}, false);
    for (std::size_t k = 0; k < drawn.size(); ++k) {
        std::vector<Column> others = alone;
        others.erase(others.begin() + static_cast<std::ptrdiff_t>(k));
        // Its Coulomb friction is named beside it, and stays beside what may stand for it.
        if (drawn[k].name == "direction_asymmetry")
            others.push_back(classes.alone({"coulomb_friction", drawn[k].size}));
        const double slack = std::pow(kLinear, 2) * (classes.rest(others, {}, false) - own);
        for (const std::string& name : names) {
            const auto drawn_too = [&](const Drawn& d) { return d.name == name; };
            if (std::any_of(drawn.begin(), drawn.end(), drawn_too)) continue;
            // It brings a saturation with it: without any of its own it is that.
            if (name == "cross_saturation" && drawn[k].name == "saturation") continue;
            const double nats = 0.5 * (classes.least(others, name) - own);
            // One that does better than the true one says that sizes are far from linear there.
            if (std::abs(nats) < kSame) drawn[k].same.push_back(name);
            if (nats - 0.5 * slack < kTold) drawn[k].close.push_back(name);
        }
    }
}

}  // namespace blind
