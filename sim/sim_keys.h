// Every field of a scenario by its path.
#ifndef DQW_SIM_KEYS_H
#define DQW_SIM_KEYS_H

#include <stddef.h>

enum dqw_sim_field_kind {
    DQW_SIM_FIELD_DOUBLE,
    DQW_SIM_FIELD_INT,
    DQW_SIM_FIELD_BOOL,
    DQW_SIM_FIELD_SEED,
    DQW_SIM_FIELD_PATH,
    DQW_SIM_FIELD_CHOICE
};

typedef struct dqw_sim_field {
    const char *key;
    size_t offset;
    enum dqw_sim_field_kind kind;
    const char *choices;  ///< names in the order of their values, each ended by a space
} dqw_sim_field;

size_t dqw_sim_field_count(void);
const dqw_sim_field *dqw_sim_field_at(size_t index);

#endif
