// Why a monitor is not in service, watches nothing at the moment, or does not watch one channel. Integers alone.
#ifndef DQW_WHY_H
#define DQW_WHY_H

#ifdef __cplusplus
extern "C" {
#endif

/// The first of these that holds.
enum dqw_why {
    DQW_WHY_IN_SERVICE = 0,  ///< it is, and watches
    DQW_WHY_NO_BLOCK,        ///< no block was ever learned
    DQW_WHY_NOISE,           ///< too few rows for the noise of currents and speed
    DQW_WHY_EXCITATION,      ///< no current or speed moves enough
    DQW_WHY_MODULATION,      ///< which legs switch is being found
    DQW_WHY_R,               ///< R is not known yet
    DQW_WHY_LQ,              ///< L_q is not known yet
    DQW_WHY_PSI,             ///< the flux is not known yet
    DQW_WHY_BLOCKS,          ///< all of them are, but too few blocks were learned
    DQW_WHY_VOLTAGE,         ///< the voltage acts one period later, or earlier, than the configuration says
    DQW_WHY_RESIDUAL,        ///< the residual is above the threshold
    // Stage 1: the domain knowledge is to be defined anew, since
    DQW_WHY_NOT_CONVERGED,  ///< the Random Learners did not settle within their limit of blocks
    DQW_WHY_THRESHOLD,      ///< ordinal learning was done with a residual above the threshold
    DQW_WHY_LEFT_BAND,      ///< the residual rose above the threshold in service
    // In service, where nothing is watched for a while
    DQW_WHY_RESTS,   ///< after an event: healthy values are taken anew
    DQW_WHY_NAMING,  ///< something has changed, and is being named
    DQW_WHY_PAUSE,   ///< no block is learned, or the weights catch up after such a while
    // Of one channel, while others are watched
    DQW_WHY_NOT_ASKED,   ///< the configuration does not ask for it, or lacks what it needs
    DQW_WHY_NOT_TAUGHT,  ///< the motion does not teach it now, or never did
    DQW_WHY_SIGN,        ///< it came out at 0 or below, as no machine's is
    DQW_WHY_OBSERVED,    ///< by its change alone: the constant is the observer's, not the machine's
    DQW_WHY_UNSETTLED,   ///< it is not known well enough for a healthy value to stand
    DQW_WHY_COARSE,      ///< watched in name only: what would be an event is more than a fault makes of it
    DQW_WHYS
};

#ifdef __cplusplus
}
#endif
#endif
