// Every field of a scenario by its path.
#ifndef DQW_SIM_KEYS_H
#define DQW_SIM_KEYS_H

#include <stddef.h>

#include "dqw_sim.h"

enum dqw_sim_field_kind {
    DQW_SIM_FIELD_DOUBLE,
    DQW_SIM_FIELD_RAMP,  ///< the value of a ramp: a double
    DQW_SIM_FIELD_INT,
    DQW_SIM_FIELD_BOOL,
    DQW_SIM_FIELD_SEED,
    DQW_SIM_FIELD_PATH,
    DQW_SIM_FIELD_CHOICE
};

/// What a double may be.
enum dqw_sim_rule {
    DQW_SIM_ANY,
    DQW_SIM_FROM_0,
    DQW_SIM_ABOVE_0,
    DQW_SIM_BELOW_1,
    DQW_SIM_TO_1,
    DQW_SIM_TO_2,
    DQW_SIM_A_GAIN
};

typedef struct dqw_sim_field {
    const char *key;
    size_t offset;
    enum dqw_sim_field_kind kind;
    enum dqw_sim_rule rule;
    const char *choices;  ///< names in the order of their values, each ended by a space
} dqw_sim_field;

/// The value of every ramp at t_s, into `now`.
void dqw_sim_ramps_at(const dqw_sim_scenario *s, double t_s, dqw_sim_nonideal *now);

size_t dqw_sim_field_count(void);
const dqw_sim_field *dqw_sim_field_at(size_t index);

#endif
