// A machine that the public firmware rombrew/phobia drives on its own switching plant (fetched by ./run), logged in each
// PWM period as its controller has it. It identifies the machine itself; then speed, load, and i_d where it is asked for,
// are drawn anew all the time. One line of JSON on stderr: the machine at the end.
//
// usage: phobia_drive LOG.csv KEY=NUMBER ...; the keys are the names in `setting` below
#include <math.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include <blm.h>
#include <lfg.h>
#include <pm.h>
#include <tsfunc.h>

// Of phobia's plant, that a kelvin makes of R and of the flux.
#define ALPHA_PER_K 3.93e-3
#define BETA_PER_K 1.2e-3
#define I_MOST_A 60.0
// Twice the relative deviation of the speed that is logged beside the rotor's own angle: of three uniforms.
#define SPEED_NOISE 5e-4

// Its own names, which its sources ask for.
blm_t m;
pmc_t pm;
void tlm_restart(void) {}

static struct {
    const char *name;
    double value;
} setting[] = {
    {"R_ohm", 0.1},      {"Ld_H", 45e-6},     {"Lq_H", 60e-6},       {"Kv_rpm_V", 100},
    {"pole_pairs", 11},  {"J_kgm2", 8e-4},    {"v_dc_V", 36},        {"source_ohm", 0.1},
    {"dead_s", 90e-9},   {"zero", 0},  // 0: the lowest leg rests, 1: centred, 2: the stronger current's
    {"encoder", 1},  // 0: its observer's angle, 1: an encoder's, 2: the observer drives, the rotor's own is logged
    {"seed", 1},         {"duration_s", 20},  {"speed", 0.5},   // part of the largest
    {"period_s", 35e-6}, {"speed_s", 0.5},    {"load_s", 0.3},  // a set point of the speed lasts so long, a load so long
    {"i_d_A", 0},        {"load_A", 0},  // at most; of the load 0 is a part of what the controller allows, one way
    {"nominal", 0},  // the log's voltage is what the link without its source's resistance would make
    {"gain_a", 1},       {"fault_s", 1e9},    {"fault_R", 1},        {"fault_psi", 1},
    {"fault_Lq", 1},     {"fault_gain_a", 1}, {"fault_offset_A", 0}, {"fault_dead_s", -1},
};
enum { SETTINGS = sizeof setting / sizeof setting[0] };

static double of(const char *name)
{
    for (int k = 0; k < SETTINGS; k++)
        if (strcmp(setting[k].name, name) == 0) return setting[k].value;
    abort();
}

static FILE *log_file;
static double start_s, gain_a = 1, offset_A;

static int shows_rotor(void) { return of("encoder") == 2; }

static double uniform(void)
{
    static uint64_t state;
    if (state == 0) state = (uint64_t)of("seed") * 2654435769u + 1;
    state = state * 6364136223846793005u + 1442695040888963407u;
    return (double)(state >> 11) * 0x1p-53;
}

static float rotor_speed(void)
{
    return (float)(m.state[2] * (1 + SPEED_NOISE * (uniform() + uniform() + uniform() - 1.5)));
}

// What stood in the controller while the plant ran: angle, voltage, and whether the sample is one.
static void put_row(float c, float s, float v_x, float v_y)
{
    const float w_e = shows_rotor() ? rotor_speed() : pm.lu_wS, half = 0.5f * w_e * pm.m_dT,
                cm = c * cosf(half) - s * sinf(half), sm = s * cosf(half) + c * sinf(half);
    fprintf(log_file, "%.7f,%.5g,%.5g,%.5g,%.5g,%.6g,%.6g\n", m.time - start_s, (double)(cm * v_x + sm * v_y),
            (double)(cm * v_y - sm * v_x), (double)(c * pm.lu_iX + s * pm.lu_iY), (double)(c * pm.lu_iY - s * pm.lu_iX),
            (double)w_e / (double)m.Zp, (double)atan2f(s, c));
}

// Called by its scripts as well.
void sim_runtime(double span_s)
{
    const double stop_s = m.time + span_s;
    while (m.time < stop_s) {
        blm_update(&m);
        pmfb_t given;
        memset(&given, 0, sizeof given);
        given.current_A = (float)(m.analog_iA * gain_a + offset_A);
        given.current_B = m.analog_iB, given.current_C = m.analog_iC;
        given.voltage_U = m.analog_uS;
        given.voltage_A = m.analog_uA, given.voltage_B = m.analog_uB, given.voltage_C = m.analog_uC;
        given.analog_SIN = m.analog_SIN, given.analog_COS = m.analog_COS;
        given.pulse_HS = m.pulse_HS, given.pulse_EP = m.pulse_EP;
        // Of the period that blm_update() has ended.
        const double rotor = m.state[3] - m.state[2] * m.pwm_dT,
                     up = of("nominal") != 0 ? of("v_dc_V") / (double)pm.const_fb_U : 1;
        const float c = shows_rotor() ? (float)cos(rotor) : pm.lu_F[0],
                    s = shows_rotor() ? (float)sin(rotor) : pm.lu_F[1], v_x = (float)up * pm.vsi_X,
                    v_y = (float)up * pm.vsi_Y;
        const int unclean = pm.vsi_IF != 0 || pm.lu_MODE == PM_LU_DETACHED || pm.lu_MODE == PM_LU_DISABLED;
        pm_feedback(&pm, &given);
        if (log_file != NULL && !unclean) put_row(c, s, v_x, v_y);
        if (pm.fsm_errno != PM_OK) {
            fprintf(stderr, "phobia stops: %s\n", pm_strerror(pm.fsm_errno));
            exit(3);
        }
    }
}

static void set_up(void)
{
    m.Rs = of("R_ohm"), m.Ld = of("Ld_H"), m.Lq = of("Lq_H"), m.Zp = (int)of("pole_pairs");
    m.lambda = blm_Kv_lambda(&m, of("Kv_rpm_V"));
    const double counts_Hz = m.pwm_resolution / m.pwm_dT;
    m.pwm_dT = of("period_s"), m.pwm_resolution = (int)lround(counts_Hz * m.pwm_dT);
    m.Jm = of("J_kgm2"), m.Udc = of("v_dc_V"), m.Rdc = of("source_ohm"), m.pwm_deadtime = of("dead_s");
    ts_script_default();
    ts_script_base();
    blm_restart(&m);
    pm.config_LU_DRIVE = PM_DRIVE_SPEED;
    const int zero = (int)of("zero");
    pm.config_VSI_ZERO = zero == 1 ? PM_VSI_CENTER : zero == 2 ? PM_VSI_EXTREME : PM_VSI_GND;
    if (of("encoder") != 1) return;
    m.eabi_ERES = m.eabi_WRAP = 16384;
    pm.config_EABI_FRONTEND = PM_EABI_ABSOLUTE;
    pm.eabi_ADJUST = PM_DISABLED;
    ts_adjust_sensor_eabi();
    blm_restart(&m);
    pm.config_LU_ESTIMATE = PM_FLUX_NONE;
    pm.config_LU_SENSOR = PM_SENSOR_EABI;
}

static void fail(void)
{
    m.Rs *= of("fault_R"), m.lambda *= of("fault_psi"), m.Lq *= of("fault_Lq");
    if (of("fault_dead_s") >= 0) m.pwm_deadtime = of("fault_dead_s");
    gain_a *= of("fault_gain_a"), offset_A = of("fault_offset_A");
}

static void drive(const char *path)
{
    const double w_most = (double)(pm.k_EMAX * pm.const_fb_U / pm.const_lambda);
    const double i_most = fmin((double)pm.i_maximal, I_MOST_A), Nm_A = 1.5 * (double)m.Zp * m.lambda;
    pm.fsm_req = PM_STATE_LU_STARTUP;
    ts_wait_IDLE();
    pm.s_setpoint_speed = (float)(0.3 * w_most);
    ts_wait_spinup();
    sim_runtime(0.3);
    start_s = m.time;
    log_file = fopen(path, "w");
    if (log_file == NULL) {
        perror(path);
        exit(2);
    }
    fputs("t_s,v_d_V,v_q_V,i_d_A,i_q_A,w_m_rad_s,theta_e_rad\n", log_file);
    const double step_s = fmin(of("speed_s"), of("load_s")) / 3;
    double speed_until = 0, load_until = 0, fault_s = of("fault_s");
    gain_a = of("gain_a");
    for (double t = 0; t < of("duration_s"); t = m.time - start_s) {
        if (t >= speed_until) {
            pm.s_setpoint_speed = (float)((0.2 + (of("speed") - 0.2) * uniform()) * w_most);
            speed_until += of("speed_s");
        }
        if (t >= load_until) {
            m.Mq[0] = Nm_A * (of("load_A") > 0 ? of("load_A") * (1 - 2 * uniform()) : 0.5 * i_most * (0.2 - uniform()));
            if (of("i_d_A") > 0) pm.forced_track_D = (float)(-of("i_d_A") * uniform());
            load_until += of("load_s");
        }
        if (t >= fault_s) fail(), fault_s = INFINITY;
        sim_runtime(step_s);
    }
    fclose(log_file);
}

int main(int argc, char *argv[])
{
    if (argc < 2) return fprintf(stderr, "usage: phobia_drive LOG.csv KEY=NUMBER ...\n"), 2;
    for (int n = 2; n < argc; n++) {
        const char *is = strchr(argv[n], '=');
        int k = 0;
        while (k < SETTINGS && (is == NULL || strlen(setting[k].name) != (size_t)(is - argv[n]) ||
                                strncmp(setting[k].name, argv[n], (size_t)(is - argv[n])) != 0))
            k++;
        if (k == SETTINGS) return fprintf(stderr, "phobia_drive: no such setting: %s\n", argv[n]), 2;
        setting[k].value = atof(is + 1);
    }
    lfg_start((int)of("seed"));
    blm_enable(&m);
    blm_restart(&m);
    // Its scripts tell what they do.
    FILE *said = freopen("/dev/null", "w", stdout);
    if (said == NULL) return 2;
    set_up();
    drive(argv[1]);
    const double warm_K = m.state[4] - m.Ta;
    fprintf(stderr, "{\"R_ohm\": %.6g, \"Ld_H\": %.6g, \"Lq_H\": %.6g, \"psi_Wb\": %.8g}\n",
            m.Rs * (1 + ALPHA_PER_K * warm_K), m.Ld, m.Lq, m.lambda * (1 - BETA_PER_K * warm_K));
    return 0;
}
