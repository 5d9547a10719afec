// The simulations that a trace's advice names: each shows the effect that it is told for.
// Plain only: long, and what it runs others run under the sanitizers.
#include <nlohmann/json.hpp>
#include <sstream>

#include "command.hpp"
#include "ref/effect/effect.hpp"
#include "unity.h"

void setUp(void) {}
void tearDown(void) {}

using command::Folder;
using command::Outcome;
using nlohmann::json;

/// What `trace` makes of what `dqwatch sim` writes with those arguments.
static json shown(const Folder& folder, const std::string& call)
{
    std::istringstream words(call);
    std::vector<std::string> args{"sim"};
    for (std::string word; words >> word;) args.push_back(word);
    // Of 2 s a third shows as much, in a third of the time.
    for (const char* two_seconds : {"servo", "traction_ipm", "effect_dead_time", "effect_angle_offset"})
        if (args[1] == two_seconds) args.insert(args.end(), {"--set", "duration_s=0.6"});
    args.insert(args.end(), {"--out", folder / ""});
    const Outcome sim = command::dqwatch(args);
    TEST_ASSERT_EQUAL_INT_MESSAGE(0, sim.code, (call + ": " + sim.err).c_str());
    const Outcome run = command::dqwatch({"trace", folder / (args[1] + ".csv"), "--json", "--out", folder / "o"});
    TEST_ASSERT_EQUAL_INT_MESSAGE(0, run.code, (call + ": " + run.err).c_str());
    return json::parse(run.out);
}

static void expect_named(const dqw::Effect& effect)
{
    const Folder folder;
    const json j = shown(folder, effect.show);
    std::string names;
    const json* found = nullptr;
    for (const json& e : j.at("effects")) {
        names += e.at("name").get<std::string>() + " ";
        if (e.at("name") == effect.name) found = &e;
    }
    TEST_ASSERT_NOT_NULL_MESSAGE(found, (std::string(effect.name) + " is not named, but: " + names).c_str());
    TEST_ASSERT_TRUE_MESSAGE(found->at("confusable_with").empty(), effect.name);
    TEST_ASSERT_TRUE_MESSAGE(found->at("confidence").get<double>() > 0.5 && found->at("confidence").get<double>() < 1.0,
                             effect.name);
}

/// Every `every`-th effect from `first`.
static void named_in_its_own_simulation(std::size_t first, std::size_t every)
{
    int shows = 0;
    for (std::size_t k = first; k < dqw::effects().size(); k += every) {
        const dqw::Effect& effect = dqw::effects()[k];
        if (*effect.show) ++shows, expect_named(effect);
    }
    TEST_ASSERT_TRUE(shows > 2);
}

static void the_first_third_of_the_catalogue_is_shown(void) { named_in_its_own_simulation(0, 3); }
static void the_second_third(void) { named_in_its_own_simulation(1, 3); }
static void the_last_third(void) { named_in_its_own_simulation(2, 3); }

/// While the shaft moves a constant load and friction that differs with the direction are one torque.
static void what_no_motion_tells_apart_is_listed(void)
{
    const Folder folder;
    const json j = shown(folder,
                         "effect_friction --set profile.speed_start_rad_s=0 --set profile.i_q_A.wave=0.15 --set "
                         "profile.i_q_A.random=0.1 --set nonideal.stribeck_Nm=0 --set nonideal.cogging_Nm=0 --set "
                         "nonideal.friction_asymmetry_Nm=0 --set profile.load_Nm=0.03 --set noise=0.002");
    std::string names;
    for (const json& e : j.at("effects")) {
        if (e.at("name") == "direction_asymmetry") names += e.at("confusable_with").dump();
        if (e.at("name") == "load_torque") names += "load_torque";
    }
    TEST_ASSERT_TRUE_MESSAGE(names.find("load_torque") != std::string::npos, j.at("effects").dump().c_str());
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(the_first_third_of_the_catalogue_is_shown);
    RUN_TEST(the_second_third);
    RUN_TEST(the_last_third);
    RUN_TEST(what_no_motion_tells_apart_is_listed);
    return UNITY_END();
}
