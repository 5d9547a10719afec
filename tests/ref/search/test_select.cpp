// Which effects are taken, of a model of which the linear step sees all, or not all.
#include "ref/search/select.hpp"

#include <algorithm>
#include <cmath>
#include <random>

#include "unity.h"

void setUp() {}
void tearDown() {}

namespace {

using dqw::Law;

constexpr int kBlocks = 40, kRows = 50;
constexpr Law kLaws[] = {Law::delay,         Law::angle_offset, Law::magnet_temperature,
                         Law::skin_effect,   Law::iron_loss,    Law::winding_temperature,
                         Law::voltage_scale, Law::sample_shift, Law::sensor_lag};
constexpr Law kFirst = Law::delay, kSecond = Law::angle_offset;

/// y = 3 + 5 x + 2 z + noise, x the first law's column and z the second's; those of the others are nothing to it. Where
/// the first law is in, the second's column as a candidate may be hidden: none of it, as far from zero as its own linear
/// step ends. A third law's may be nearly the first's, a fourth's what both are, and noise.
class Columns : public dqw::Model {
public:
    explicit Columns(bool hides, Law first = kFirst, Law alike = Law::pulses, Law both = Law::pulses)
        : hides_(hides), first_(first), alike_(alike), both_(both)
    {
        std::mt19937 random(7);
        std::normal_distribution<double> normal;
        for (auto& column : columns_)
            for (double& x : column) x = normal(random);
        for (double& x : noise_) x = 0.5 * normal(random);
        for (std::size_t b = 0; b < kBlocks; ++b)
            plan_.blocks.push_back({nullptr, kRows * b, kRows * (b + 1), b % 2 == 1});
    }
    const std::vector<std::string>& base_names() const override { return names_; }
    int channels() const override { return 1; }
    int gains() const override { return 0; }
    bool common_weight() const override { return false; }
    const dqw::Plan& plan() const override { return plan_; }
    const std::vector<double>& measured(const dqw::Log&, int) const override { return none_; }
    std::vector<dqw::ReportBlock> report(const dqw::Point&, std::size_t) const override { return {}; }
    double column(Law law, std::size_t row) const
    {
        constexpr double kNearly = 1e-3;
        if (law == alike_) return column(first_, row) + kNearly * columns_.back()[row];
        if (law == both_) return 5.0 * column(first_, row) + 2.0 * column(kSecond, row) + columns_.back()[row];
        for (std::size_t n = 0; n < std::size(kLaws); ++n)
            if (kLaws[n] == law) return columns_[n][row];
        return 0.0;
    }
    double error(const dqw::Point& at, std::size_t row) const
    {
        double e = 3.0 + 5.0 * column(first_, row) + 2.0 * column(kSecond, row) + noise_[row] - at.base[0];
        for (const dqw::Term& t : at.terms) e -= t.weights[0] * column(t.input.law, row);
        return e;
    }
    bool sweep(const dqw::Point& at, const std::vector<dqw::Input>* candidates,
               std::vector<dqw::BlockSum>& sums) const override
    {
        sums = dqw::empty_sums(kBlocks, 1, dqw::columns_of(at, candidates));
        const bool first = !at.terms.empty() && at.terms.front().input.law == first_;
        for (std::size_t b = 0; b < kBlocks; ++b)
            for (std::size_t row = kRows * b; row < kRows * (b + 1); ++row) {
                std::vector<double> line{-1.0};
                for (const dqw::Term& t : at.terms) line.push_back(-column(t.input.law, row));
                if (candidates)
                    for (const dqw::Input& i : *candidates)
                        line.push_back(hides_ && first && i.law == kSecond ? columns_.back()[row]
                                                                           : -column(i.law, row));
                line.push_back(error(at, row));
                const Eigen::Map<const Eigen::VectorXd> l(line.data(), static_cast<Eigen::Index>(line.size()));
                sums[b].gram[0] += l * l.transpose(), ++sums[b].rows;
            }
        return true;
    }
    double rms(const dqw::Point& at) const
    {
        double square = 0.0;
        for (std::size_t b = 1; b < kBlocks; b += 2)
            for (std::size_t row = kRows * b; row < kRows * (b + 1); ++row) square += std::pow(error(at, row), 2);
        return std::sqrt(square / (kBlocks / 2 * kRows));
    }

private:
    bool hides_;
    Law first_, alike_, both_;
    std::array<std::array<double, kBlocks * kRows>, std::size(kLaws) + 1> columns_{};
    std::array<double, kBlocks * kRows> noise_{};
    std::vector<std::string> names_{"R_ohm"};
    std::vector<double> none_;
    dqw::Plan plan_;
};

dqw::Point start()
{
    dqw::Point at;
    at.base.resize(1), at.gain.resize(0), at.base[0] = 1.0;
    return at;
}

dqw::SelectOptions options_of(const Columns& model)
{
    dqw::SelectOptions options;
    options.reported_rms = [&model](const dqw::Point& at) { return std::vector<double>{model.rms(at)}; };
    options.reported_rms_to = [&model](const dqw::Point& at, double) { return model.rms(at); };
    return options;
}

/// Its linear step sees the second beside the first, or ranks it behind five that are nothing: it stood in the round
/// before.
void what_stood_before_is_fitted_again()
{
    for (const bool hides : {false, true}) {
        const Columns model(hides);
        std::vector<dqw::Candidate> candidates;
        for (const Law law : kLaws) candidates.push_back({{{law, {}}}});
        const dqw::Selection s = dqw::select(model, start(), candidates, options_of(model));
        TEST_ASSERT_EQUAL_size_t(2, s.found.size());
        TEST_ASSERT_EQUAL_STRING(dqw::name_of(kFirst), s.found[0].name.c_str());
        TEST_ASSERT_EQUAL_STRING(dqw::name_of(kSecond), s.found[1].name.c_str());
        // Four deviations of a mean of a thousand rows.
        TEST_ASSERT_DOUBLE_WITHIN(0.064, 3.0, s.best.point.base[0]);
        TEST_ASSERT_DOUBLE_WITHIN(0.064, 5.0, s.best.point.terms[0].weights[0]);
        TEST_ASSERT_DOUBLE_WITHIN(0.064, 2.0, s.best.point.terms[1].weights[0]);
    }
}

/// A loss that a shift of the angle cannot be told from is that shift where both are as small as sampling makes them.
void a_loss_as_small_as_sampling_is_a_shift()
{
    const Columns model(false, Law::iron_loss, Law::sample_shift);
    const std::vector<dqw::Candidate> candidates = {{{{Law::iron_loss, {}}}},
                                                    {{{Law::sample_shift, {static_cast<double>(dqw::Instant::angle)}}}},
                                                    {{{Law::angle_offset, {}}}}};
    const char *loss = "iron_loss", *shift = "sample_shift";
    for (const char* small : {"", loss, shift, "both"}) {
        dqw::SelectOptions options = options_of(model);
        dqw::Selection s = dqw::select(model, start(), candidates, options);
        TEST_ASSERT_EQUAL_STRING(loss, s.found[0].name.c_str());
        options.may_be_sampling = [&](const dqw::Point&, const std::string& name) {
            return std::string(small) == "both" || name == small;
        };
        // Once all is found, as where it is.
        const bool goes = dqw::look_alikes(model, candidates, options, true, s);
        TEST_ASSERT_EQUAL(std::string(small) == "both", goes);
        TEST_ASSERT_EQUAL_STRING(goes ? shift : loss,
                                 dqw::select(model, start(), candidates, options).found[0].name.c_str());
        TEST_ASSERT_FALSE(dqw::look_alikes(model, candidates, options, true, s));
        // The other is listed beside it.
        TEST_ASSERT_EQUAL_size_t(2, s.found.size());
        TEST_ASSERT_EQUAL_STRING(goes ? shift : loss, s.found[0].name.c_str());
        TEST_ASSERT_EQUAL_size_t(1, s.found[0].confusable_with.size());
        TEST_ASSERT_EQUAL_STRING(goes ? loss : shift, s.found[0].confusable_with[0].c_str());
        for (const dqw::Term& t : s.best.point.terms)
            TEST_ASSERT_DOUBLE_WITHIN(0.064, t.input.law == Law::angle_offset ? 2.0 : 5.0, t.weights[0]);
    }
}

/// A loss that takes most of what two others are, and makes no sense beside either.
void what_hides_two_others_goes_for_them()
{
    const Columns model(false, kFirst, Law::pulses, Law::iron_loss);
    std::vector<dqw::Candidate> candidates;
    for (const Law law : {kFirst, kSecond, Law::iron_loss}) candidates.push_back({{{law, {}}}});
    dqw::SelectOptions options = options_of(model);
    int refused = 0;
    options.veto = [&refused](const dqw::Point& at) -> std::string {
        const auto is_loss = [](const dqw::Term& t) { return t.input.law == Law::iron_loss; };
        const bool no = at.terms.size() > 1 && std::any_of(at.terms.begin(), at.terms.end(), is_loss);
        refused += no ? 1 : 0;
        return no ? "it would not be of one loss" : "";
    };
    const dqw::Selection s = dqw::select(model, start(), candidates, options);
    TEST_ASSERT_TRUE(refused > 0);
    TEST_ASSERT_EQUAL_size_t(2, s.found.size());
    TEST_ASSERT_EQUAL_STRING(dqw::name_of(kFirst), s.found[0].name.c_str());
    TEST_ASSERT_EQUAL_STRING(dqw::name_of(kSecond), s.found[1].name.c_str());
    // What each would take alone is told of all three.
    TEST_ASSERT_EQUAL_size_t(3, s.alone.size());
}

}  // namespace

int main()
{
    UNITY_BEGIN();
    RUN_TEST(what_stood_before_is_fitted_again);
    RUN_TEST(what_hides_two_others_goes_for_them);
    RUN_TEST(a_loss_as_small_as_sampling_is_a_shift);
    return UNITY_END();
}
