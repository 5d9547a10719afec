// What `dqwatch trace` found in joint_24v.csv: the effects that the plain model lacks, for the learners.
// Fill in a dqw_estimator_config as before, call dqw_model_config_apply(&config), then dqw_estimator_init(); on a
// running one dqw_estimator_define().
// Of a monitor: dqw_model_config_apply_monitor(&config), dqw_monitor_init(), dqw_monitor_define(). Pole pairs must be
// given where there are effects.
#ifndef DQW_MODEL_CONFIG_H
#define DQW_MODEL_CONFIG_H

#include "dqw.h"

// To start from, SI.
#define DQW_MODEL_POLE_PAIRS 4
#define DQW_MODEL_R_OHM 0.5000781f
#define DQW_MODEL_LD_H 0.0009995669f
#define DQW_MODEL_LQ_H 0.001400759f
#define DQW_MODEL_PSI_WB 0.02000212f

#define DQW_MODEL_EFFECT_COUNT 1
#define DQW_MODEL_MONITOR_EFFECT_COUNT 1

#if DQW_EFFECT_WEIGHTS < 4
#error "build lib/ with -DDQW_EFFECT_WEIGHTS=4 or more"
#endif

// Effect, shape, weights to start from, a flux map's table.
static const dqw_effect_config dqw_model_effects[DQW_MODEL_EFFECT_COUNT] = {
    {DQW_EFFECT_FLUX_HARMONICS,
     {6.0f, 0.0f, 0.0f, 0.0f},
     {0.0004001138f, -4.334987e-07f, -1.304746e-06f, 0.0002998986f, 0.0f},
     0},
};

static inline void dqw_model_config_apply(dqw_estimator_config *config)
{
    config->pole_pairs = DQW_MODEL_POLE_PAIRS;
    config->R_ohm = DQW_MODEL_R_OHM;
    config->Ld_H = DQW_MODEL_LD_H;
    config->Lq_H = DQW_MODEL_LQ_H;
    config->psi_Wb = DQW_MODEL_PSI_WB;
    config->effects = dqw_model_effects;
    config->effect_count = DQW_MODEL_EFFECT_COUNT;
}

// A monitor has inputs of its own for the angle, the current sensors and unlike phases.
static inline void dqw_model_config_apply_monitor(dqw_monitor_config *config)
{
    dqw_model_config_apply(&config->estimator);
    config->estimator.effect_count = DQW_MODEL_MONITOR_EFFECT_COUNT;
}

#endif
