// What 0.1 V that the model lacks makes of a 48 V drive's parameters, and whether their deviations say so: errors that
// are constant in the rotor's frame, or go with the current, by how the drive is driven. Where a value is off by more
// than two of its deviations it is marked !, where it is usable and off by more than a tenth !!. Options: --seeds N
// (1), --told (the configuration says by how much the voltage is off).
#include "drive_48v.h"

static const driven WAYS[] = {
    {"to and fro, 15 A", 0, 70, 0, 20, 0, 17, 1, true},
    {"to and fro, 15 A, no angle", 0, 70, 0, 20, 0, 17, 1, false},
    {"to and fro, 3 A", 0, 70, 0, 2.6, 0, 5.2, 1, true},
    {"to and fro, 1 A", 0, 70, 0, 0.9, 0, 1.7, 1, true},
    {"to and fro, 8 A held", 0, 70, 0, 0.9, 8, 1.7, 1, true},
    {"one point", 50, 5, -9, 3.5, 10, 3.5, 1, true},
    {"one point, no angle", 50, 5, -9, 3.5, 10, 3.5, 1, false},
};
enum { WAYS_COUNT = sizeof WAYS / sizeof WAYS[0] };

typedef struct {
    int values, beyond, misleading;
} tally;

static void cell(const either_monitor *m, const dqw_sim_machine *machine, int i, tally *t)
{
    const double truth = joint_truth(machine, i);
    const dqw_reading r = either_read(m, (enum dqw_parameter)i);
    const double off = (double)r.value / truth - 1;
    const bool beyond = fabs((double)r.value - truth) > 2 * (double)r.sd;
    const bool misleads = r.usable && fabs(off) > 0.1;
    t->values++;
    t->beyond += beyond;
    t->misleading += misleads;
    printf(" %+6.2f +- %-5.2f%s%s |", 100 * off, 100 * (double)r.sd / truth, r.usable ? "" : " (not usable)",
           misleads ? " !!"
           : beyond ? " !"
                    : "");
}

int main(int argc, char **argv)
{
    const int seeds = (int)joint_number(argc, argv, "--seeds", 1);
    const bool told = joint_flag(argc, argv, "--told");
    tally all[2][4] = {{{0, 0, 0}}};
    printf("0.1 V of model error on a 48 V drive, 8 s: error and deviation, %% of the truth\n\n");
    printf("| error | driven | arithmetic | 0.1 V over R i | R | L_d | L_q | flux |\n"
           "| --- | --- | --- | --: | --: | --: | --: | --: |\n");
    for (int k = 0; k < DRIVE_48V_ERRORS; k++)
        for (int n = 0; n < WAYS_COUNT; n++)
            for (int seed = 1; seed <= seeds; seed++) {
                const voltage_error *e = &drive_48v_errors[k];
                if (e->told && !WAYS[n].angle) continue;
                const dqw_sim_scenario s = drive_48v(e, &WAYS[n], seed, 8.0);
                const joint_log log = joint_run(&s);
                const drive_48v_rms rms = drive_48v_measure(&log, &s.machine);
                dqw_monitor_config c = drive_48v_monitor(e, &WAYS[n], &s);
                if (told) c.estimator.voltage_error_V = (float)drive_48v_off_V(e);
                for (int q15 = 0; q15 < 2; q15++) {
                    static either_monitor m;
                    if (either_init(&m, &c, q15 == 1) != DQW_OK) return 1;
                    const int events = drive_48v_watch(&m, &c, &log);
                    printf("| %s | %s | %s | %.1f |", e->text, WAYS[n].text, q15 ? "q15" : "float",
                           10 / rms.i_A / s.machine.R_ohm);
                    for (int i = 0; i < JOINT_PARAMETERS; i++)
                        cell(&m, &s.machine, i, &all[e->dead_V > 0 && !e->told][i]);
                    printf("\n");
                    if (events > 0 || either_stage(&m)->name != DQW_STAGE_IN_SERVICE)
                        printf("  %d events, stage %d\n", events, (int)either_stage(&m)->name);
                }
                free(log.row);
            }
    for (int with_current = 0; with_current < 2; with_current++) {
        printf("\n%s: beyond two deviations", with_current ? "Goes with the current, not told" : "The others");
        for (int i = 0; i < JOINT_PARAMETERS; i++) {
            const tally *t = &all[with_current][i];
            printf("%s %s %d of %d", i ? "," : "", (const char *[]){"R", "L_d", "L_q", "flux"}[i], t->beyond,
                   t->values);
            if (t->misleading > 0) printf(" (%d usable and off by a tenth)", t->misleading);
        }
    }
    printf("\n");
    return 0;
}
