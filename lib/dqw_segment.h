// Has a weight changed? Of a segment of driving, what it says of each weight against the long memory; how far that
// scatters in health, learned; and whether it agrees from one segment to the next.
#ifndef DQW_SEGMENT_H
#define DQW_SEGMENT_H

#include <stdbool.h>
#include <stdint.h>

#include "dqw_parts.h"

#ifdef __cplusplus
extern "C" {
#endif

/// What is known of the weights before a segment, per unit.
typedef struct dqw_segment_known {
    float least_pu[DQW_FOLLOWED];  ///< no band is narrower
    float model_pu[DQW_FOLLOWED];  ///< what the model's error may make of a band that is not known yet
    float wide_pu[DQW_FOLLOWED];   ///< how far a weight may have jumped; 0: it is never found changed
} dqw_segment_known;

/// Nothing seen. band_pu[DQW_FOLLOWED]: how far each weight may scatter, to begin with; > 0.
#define dqw_segment_init DQW_SIZED(dqw_segment_init)
void dqw_segment_init(dqw_segment *s, const float band_pu[]);

/// Forget what is being gathered, and what seemed to agree.
void dqw_segment_restart(dqw_segment *s);

/// One row: its inputs, 0 where they teach nothing, and what the weights leave of its target.
///
/// Source   (E104) in docs/EQUATIONS.md
/// Shape    x_pu[DQW_FOLLOWED], read only
/// Cost     35 products, 54 with a map's weights
/// Context  background
void dqw_segment_row(dqw_segment *s, const float x_pu[], float error_pu);

/// One block's speed and current on q, per unit. A segment outlasts an operating point: it ends when both have moved in
/// it as much as they do in the long run, after `least` blocks and before `most`.
///
/// Source   (E104) in docs/EQUATIONS.md
/// Returns  true where the segment ends: dqw_segment_end() must follow
/// Context  background
bool dqw_segment_block(dqw_segment *s, float w_pu, float i_pu, uint32_t least, uint32_t most);

/// The segment ends: bands move to its scatter, sums of what agrees go on, all that was gathered is forgotten.
///
/// Source   (E104), (E105) in docs/EQUATIONS.md
/// Units    variance_pu2: of a row's error, > 0
/// Returns  the weight that has changed, -1: none; then move_pu[DQW_FOLLOWED] is by how much each one is to be moved
/// Cost     n^3 / 3 products for n = DQW_FOLLOWED, twice where one has changed
/// Context  background
int dqw_segment_end(dqw_segment *s, float variance_pu2, const dqw_segment_known *known, float move_pu[]);

/// How far beyond what scatter allows segments agree that a weight is off, in deviations.
/// Source   (E105) in docs/EQUATIONS.md
float dqw_segment_agreed(const dqw_segment *s, int weight);

/// The smallest change of a weight that two segments would tell, per unit.
///
/// Source   (E105) in docs/EQUATIONS.md
/// Range    DQW_UNKNOWN where the last segment said nothing of it
/// Context  background
float dqw_segment_sees(const dqw_segment *s, int weight);

#ifdef __cplusplus
}
#endif
#endif
