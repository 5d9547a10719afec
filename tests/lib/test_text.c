// Every enumerator of lib/'s own headers has a text of its own, and what is no enumerator has none: the headers are
// read to know them.
#include <ctype.h>
#include <limits.h>

#include "dqw_test.h"
#include "dqw_text.h"

void setUp(void) { test_case[0] = 0; }
void tearDown(void) {}

static const char *of_status(int at) { return dqw_status_text((enum dqw_status)at); }
static const char *of_parameter(int at) { return dqw_parameter_text((enum dqw_monitor_channel)at); }
static const char *of_fault(int at) { return dqw_fault_text((enum dqw_fault_name)at); }
static const char *of_effect(int at) { return dqw_effect_text((enum dqw_effect_name)at); }
static const char *of_stage(int at) { return dqw_stage_text((enum dqw_stage_name)at); }
static const char *of_why(int at) { return dqw_why_text((enum dqw_why)at); }

enum { MOST = 100 };

typedef struct listing {
    int count;
    int value[MOST];
    char name[MOST][60];
} listing;

// The enumerators of `enum NAME {` in a header, without the one that counts them.
static listing read_enum(const char *path, const char *name, const char *counter)
{
    FILE *file = fopen(path, "r");
    TEST_ASSERT_NOT_NULL_MESSAGE(file, path);
    listing out = {0};
    char begin[80];
    char line[400];
    (void)snprintf(begin, sizeof begin, "enum %s {", name);
    bool inside = false;
    int next = 0;
    while (fgets(line, sizeof line, file) != NULL) {
        if (!inside) {
            inside = strncmp(line, begin, strlen(begin)) == 0;
            continue;
        }
        if (line[0] == '}') break;
        const char *at = line + strspn(line, " ");
        if (strncmp(at, "DQW_", 4) != 0) continue;
        const size_t length = strspn(at, "ABCDEFGHIJKLMNOPQRSTUVWXYZ0123456789_");
        const char *given = at + length + strspn(at + length, " ");
        if (*given == '=') next = (int)strtol(given + 1, NULL, 10);
        if (strncmp(at, counter, length) != 0 || strlen(counter) != length) {
            TEST_ASSERT_TRUE(out.count < MOST && length < sizeof out.name[0]);
            memcpy(out.name[out.count], at, length);
            out.value[out.count++] = next;
        }
        next++;
    }
    (void)fclose(file);
    return out;
}

static bool listed(const listing *l, int value)
{
    for (int i = 0; i < l->count; i++)
        if (l->value[i] == value) return true;
    return false;
}

static listing judge(const char *path, const char *name, const char *counter, int least, const char *(*text)(int))
{
    const listing l = read_enum(path, name, counter);
    CASE("%s: %d enumerators", name, l.count);
    HOLDS(l.count >= least);
    for (int i = 0; i < l.count; i++) {
        CASE("%s %s: \"%s\"", name, l.name[i], text(l.value[i]));
        HOLDS(strlen(text(l.value[i])) > 3 && strchr(text(l.value[i]), '\n') == NULL);
        for (int j = 0; j < i; j++) HOLDS(strcmp(text(l.value[i]), text(l.value[j])) != 0);
    }
    for (int at = -200; at <= 200; at++) {
        CASE("%s %d: \"%s\"", name, at, text(at));
        HOLDS(listed(&l, at) == (strcmp(text(at), "?") != 0));
    }
    HOLDS(strcmp(text(INT_MAX), "?") == 0 && strcmp(text(INT_MIN), "?") == 0);
    return l;
}

static void test_every_enumerator_has_a_text_of_its_own(void)
{
    (void)judge("lib/dqw_status.h", "dqw_status", "", 40, of_status);
    (void)judge("lib/dqw_state.h", "dqw_monitor_channel", "DQW_WATCH_CHANNELS", 13, of_parameter);
    (void)judge("lib/dqw_state.h", "dqw_stage_name", "", 4, of_stage);
    (void)judge("lib/dqw_why.h", "dqw_why", "DQW_WHYS", 21, of_why);
}

// DQW_FAULT_TURN_SHORT is "turn_short".
static void test_faults_and_effects_are_called_as_their_enumerators(void)
{
    const listing all[] = {judge("lib/dqw_fault_name.h", "dqw_fault_name", "DQW_FAULT_NAMES", 13, of_fault),
                           judge("lib/dqw_effect_name.h", "dqw_effect_name", "DQW_EFFECT_NAMES", 20, of_effect)};
    for (int k = 0; k < 2; k++)
        for (int i = 0; i < all[k].count; i++) {
            const char *text = k == 0 ? of_fault(all[k].value[i]) : of_effect(all[k].value[i]);
            char called[60] = {0};
            const char *end = all[k].name[i] + strlen(k == 0 ? "DQW_FAULT_" : "DQW_EFFECT_");
            for (size_t c = 0; end[c] != 0; c++) called[c] = (char)tolower((unsigned char)end[c]);
            TEST_ASSERT_EQUAL_STRING(called, text);
        }
}

// A refusal begins with the field that it names.
static void test_a_refusal_names_its_field(void)
{
    static const struct {
        enum dqw_status status;
        const char *field;
    } fields[] = {
        {DQW_ERR_DT, "dt_s: "},
        {DQW_ERR_V_BASE, "v_base_V: "},
        {DQW_ERR_I_BASE, "i_base_A: "},
        {DQW_ERR_W_BASE, "w_base_rad_s: "},
        {DQW_ERR_TORQUE_BASE, "torque_base_Nm: "},
        {DQW_ERR_R, "R_ohm: "},
        {DQW_ERR_LD, "Ld_H: "},
        {DQW_ERR_LQ, "Lq_H: "},
        {DQW_ERR_PSI, "psi_Wb: "},
        {DQW_ERR_J, "J_kgm2: "},
        {DQW_ERR_B, "B_Nms_rad: "},
        {DQW_ERR_POLE_PAIRS, "pole_pairs: "},
        {DQW_ERR_HALF_WINDOW, "half_window: 0 (the default) or 1 .. 10000 pairs, in fixed point up to 100"},
        {DQW_ERR_V_LIMIT, "v_limit_V: "},
        {DQW_ERR_I_LIMIT, "i_limit_A: "},
        {DQW_ERR_EXCITATION, "excitation_pu: "},
        {DQW_ERR_DEAD_TIME_WIDTH, "dead_time_width_A: "},
        {DQW_ERR_VOLTAGE_ERROR, "voltage_error_V: "},
        {DQW_ERR_COULOMB_WIDTH, "coulomb_width_rad_s: "},
        {DQW_ERR_STANDSTILL, "standstill_rad_s: "},
        {DQW_ERR_BAND, "band: "},
        {DQW_ERR_ALPHA, "alpha_per_K: "},
        {DQW_ERR_BETA, "beta_per_K: "},
        {DQW_ERR_HEATING, "heating_K_s: "},
        {DQW_ERR_MODULATION, "modulation: "},
        {DQW_ERR_ANGLE_LATE, "angle_late_s: "},
        {DQW_ERR_VOLTAGE_SCALE, "voltage_scale_ppm: "},
        {DQW_ERR_TURN, "w_full_mrad_s, pole_pairs and dt_ns together: "},
    };
    for (unsigned k = 0; k < sizeof fields / sizeof fields[0]; k++)
        TEST_ASSERT_EQUAL_STRING_LEN(fields[k].field, dqw_status_text(fields[k].status), strlen(fields[k].field));
}

static void test_parameters_carry_their_unit(void)
{
    static const char *const names[] = {
        "R_ohm",    "Ld_H",       "Lq_H",        "psi_Wb",        "dead_time_V",
        "psi_q_Wb", "flux_map_d", "flux_map_q",  "offset_A",      "phase_resistance_ohm",
        "gain_H",   "short_S",    "friction_Nm", "temperature_K", "residual_V"};
    for (int i = 0; i < DQW_WATCH_CHANNELS; i++) TEST_ASSERT_EQUAL_STRING(names[i], of_parameter(i));
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(test_every_enumerator_has_a_text_of_its_own);
    RUN_TEST(test_faults_and_effects_are_called_as_their_enumerators);
    RUN_TEST(test_a_refusal_names_its_field);
    RUN_TEST(test_parameters_carry_their_unit);
    return UNITY_END();
}
