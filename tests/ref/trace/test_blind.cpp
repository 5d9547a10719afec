// The blind campaign's judge, and a fixed twenty of its logs, traced.
// Plain only: long, and what it runs others run under the sanitizers.
#include <cstdio>
#include <cstdlib>
#include <string>

#include "bench/blind.hpp"
#include "command.hpp"
#include "unity.h"

void setUp(void) {}
void tearDown(void) {}

using blind::Kind;
using blind::Outcome;

static Outcome said(std::vector<std::string> truth, std::vector<std::string> named,
                    std::vector<std::vector<std::string>> confusable)
{
    Outcome o;
    o.kind = truth.empty() ? Kind::clean : truth.size() == 1 ? Kind::one : Kind::two;
    o.verdict = named.empty() ? "clean" : "explained";
    o.truth = truth, o.named = named, o.confusable = confusable;
    return o;
}

static void right_is_what_was_named_or_could_be_meant(void)
{
    TEST_ASSERT_TRUE(said({}, {}, {}).right());
    TEST_ASSERT_TRUE(said({"delay"}, {"delay"}, {{}}).right());
    TEST_ASSERT_TRUE(said({"delay"}, {"angle_offset"}, {{"iron_loss", "delay"}}).right());
    TEST_ASSERT_TRUE(said({"delay", "dead_time"}, {"dead_time", "delay"}, {{}, {}}).right());
    TEST_ASSERT_TRUE(said({"delay", "dead_time"}, {"dead_time", "iron_loss"}, {{}, {"delay"}}).right());
}

static void wrong_is_a_missed_a_false_or_a_vague_one(void)
{
    TEST_ASSERT_FALSE(said({"delay"}, {}, {}).right());
    TEST_ASSERT_FALSE(said({}, {"delay"}, {{}}).right());
    TEST_ASSERT_FALSE(said({"delay"}, {"iron_loss"}, {{}}).right());
    TEST_ASSERT_FALSE(said({"delay"}, {"delay", "iron_loss"}, {{}, {}}).right());
    TEST_ASSERT_FALSE(said({"delay", "dead_time"}, {"delay"}, {{}}).right());
    TEST_ASSERT_FALSE(
        said({"delay"}, {"dead_time"}, {{"iron_loss", "voltage_offset", "angle_offset", "delay"}}).right());
    Outcome outside = said({"hum"}, {}, {});
    outside.kind = Kind::outside;
    TEST_ASSERT_TRUE(outside.right());
    outside.named = {"current_offset"}, outside.confusable = {{}};
    TEST_ASSERT_FALSE(outside.right());
    Outcome thrown = said({}, {}, {});
    thrown.failure = "too few rows";
    TEST_ASSERT_FALSE(thrown.right());
}

static void base_parameters_have_their_bounds(void)
{
    blind::Case c;
    c.truth.R_ohm = 2, c.truth.Ld_H = 1e-3, c.truth.psi_Wb = 0.1;
    const auto off = [&](double R, double Ld, double psi) {
        dqw::TraceResult r;
        r.after.parameters = {{"R_ohm", R, 0.0, false}, {"Ld_H", Ld, 0.0, false}, {"psi_Wb", psi, 0.0, false}};
        return blind::score(c, r, 1).base_right();
    };
    TEST_ASSERT_TRUE(off(2.039, 0.981e-3, 0.1004));
    TEST_ASSERT_FALSE(off(2.041, 1e-3, 0.1));
    TEST_ASSERT_FALSE(off(2, 0.979e-3, 0.1));
    TEST_ASSERT_FALSE(off(2, 1e-3, 0.1006));
}

static void an_outcome_survives_its_line(void)
{
    Outcome o = said({"delay", "dead_time"}, {"dead_time", "iron_loss"}, {{}, {"delay", "angle_offset"}});
    o.seed = 77, o.strength = 3.25, o.about = "servo\ttab", o.off = {{"R_ohm", -1.5}, {"psi_Wb", 0.25}}, o.seconds = 2;
    const Outcome back = blind::outcome_of(blind::line_of(o));
    TEST_ASSERT_EQUAL_UINT64(77, back.seed);
    TEST_ASSERT_TRUE(back.kind == Kind::two && back.truth == o.truth && back.named == o.named &&
                     back.confusable == o.confusable);
    TEST_ASSERT_TRUE(back.failure.empty() && back.verdict == "explained" && back.about == "servo tab");
    TEST_ASSERT_EQUAL_DOUBLE(3.25, back.strength);
    TEST_ASSERT_EQUAL_size_t(2, back.off.size());
    TEST_ASSERT_EQUAL_DOUBLE(-1.5, back.off[0].percent);
    const Outcome clean = blind::outcome_of(blind::line_of(said({}, {}, {})));
    TEST_ASSERT_TRUE(clean.right() && clean.truth.empty() && clean.named.empty() && clean.confusable.empty() &&
                     clean.off.empty());
}

static void the_report_counts(void)
{
    Outcome right = said({"delay"}, {"delay"}, {{}}), missed = said({"delay"}, {}, {}),
            mistaken = said({"delay"}, {"iron_loss"}, {{}});
    right.strength = missed.strength = mistaken.strength = 5, right.seed = 4, missed.seed = 5, mistaken.seed = 6;
    const std::string text = blind::report({right, missed, mistaken, said({}, {}, {})});
    TEST_ASSERT_TRUE_MESSAGE(text.find("| delay | 3 | 1 | 0 | 1 | 0 | iron_loss 1 |") != text.npos, text.c_str());
    TEST_ASSERT_TRUE_MESSAGE(text.find("noise floor      1 of   3") != text.npos, text.c_str());
    TEST_ASSERT_TRUE(text.find("blind --seed 4\n") == text.npos && text.find("blind --seed 5\n") != text.npos);
}

// Strength is what a fit that knows nothing of the effects leaves over the floor: the tracer's own `before` judges the
// draw.
static void fixed_logs_are_traced(void)
{
    if (command::sanitized()) TEST_IGNORE_MESSAGE("six logs: plain alone");
    const std::uint64_t seeds[] = {1, 50, 103, 112, 219, 299};
    int wrong = 0;
    for (const std::uint64_t seed : seeds) {
        const blind::Case c = blind::draw(seed);
        const dqw::TraceResult result = dqw::trace({c.log});
        const Outcome o = blind::score(c, result, 0);
        const double ratio = result.before.heldout_rms / c.noise_floor;
        const bool as_drawn = ratio > 0.6 * (c.kind == Kind::clean ? 1 : o.strength) &&
                              (c.kind != Kind::one || ratio < 1.8 * o.strength);
        const bool verdict = c.kind != Kind::clean || result.verdict == "clean";
        if (o.right() && (c.kind == Kind::outside || o.base_right()) && as_drawn && verdict) continue;
        ++wrong;
        std::printf("build/bench/blind --seed %llu: right %d, base %d, as drawn %d (%.2f for %.2f), %s; %s\n",
                    static_cast<unsigned long long>(seed), o.right(), o.base_right(), as_drawn, ratio, o.strength,
                    result.verdict.c_str(), c.about.c_str());
    }
    TEST_ASSERT_EQUAL_INT(0, wrong);
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(right_is_what_was_named_or_could_be_meant);
    RUN_TEST(wrong_is_a_missed_a_false_or_a_vague_one);
    RUN_TEST(base_parameters_have_their_bounds);
    RUN_TEST(an_outcome_survives_its_line);
    RUN_TEST(the_report_counts);
    RUN_TEST(fixed_logs_are_traced);
    return UNITY_END();
}
