// Has a weight changed, in whole numbers: of a segment of driving, what it says of each weight against the long memory;
// how far that scatters in health, learned; and whether it agrees from one segment to the next.
#ifndef DQW_SEGMENT_Q15_H
#define DQW_SEGMENT_Q15_H

#include <stdbool.h>
#include <stdint.h>

#include "dqw_size.h"

#ifdef __cplusplus
extern "C" {
#endif

/// Mean and variance of a signal, of its full scale.
typedef struct dqw_moments_q15 {
    int32_t mean_q30;
    uint32_t variance_q31;  ///< below 2
} dqw_moments_q15;

typedef struct dqw_segment_q15 {
    /// sums of x x', as DQW_NORMAL_A() has them, and of x e: in Q56, less so many bits
    int32_t a[DQW_FOLLOWED * (DQW_FOLLOWED + 1) / 2], b[DQW_FOLLOWED];
    int32_t band_q28[DQW_FOLLOWED];                        ///< how far a weight scatters between segments in health
    int16_t up_q11[DQW_FOLLOWED], down_q11[DQW_FOLLOWED];  ///< sums of what agrees
    dqw_moments_q15 now[2], ever[2];                       ///< of speed and current: in the segment, in the long run
    uint16_t run, blocks;                                  ///< blocks of both, up to 65535
    uint16_t segments, since;
    uint16_t share_q15[DQW_FOLLOWED];  ///< what the last segment knew of a weight, over its band
    uint8_t a_bits, b_bits;
    bool urgent;  ///< something shows already: this segment alone may tell what has changed
    bool agreed;  ///< the weight that was found changed seemed so in the segment before
} dqw_segment_q15;

/// What is known of the weights before a segment, of their units.
typedef struct dqw_segment_q15_known {
    int32_t least_q28[DQW_FOLLOWED];  ///< no band is narrower
    int32_t model_q28[DQW_FOLLOWED];  ///< what the model's error may make of a band that is not known yet
    int32_t wide_q28[DQW_FOLLOWED];   ///< how far a weight may have jumped; 0: it is never found changed
} dqw_segment_q15_known;

/// Nothing seen. band_q28[DQW_FOLLOWED]: how far each weight may scatter, to begin with; >= 0.
void dqw_segment_init_q15(dqw_segment_q15 *s, const int32_t band_q28[]);

/// Forget what is being gathered, and what seemed to agree.
void dqw_segment_restart_q15(dqw_segment_q15 *s);

/// One row: its inputs, 0 where they teach nothing, and what the weights leave of its target.
///
/// Source   (E104) in docs/EQUATIONS.md
/// Shape    x_q28[DQW_FOLLOWED], read only
/// Range    any
/// Cost     35 products of 32 by 32 bits
/// Context  background
void dqw_segment_row_q15(dqw_segment_q15 *s, const int32_t x_q28[], int32_t error_q28);

/// One block's speed and current on q, of the full scales. A segment outlasts an operating point: it ends when both
/// have moved in it as much as they do in the long run, after `least` blocks and before `most`, or 65535.
///
/// Source   (E104) in docs/EQUATIONS.md
/// Range    |x| <= 1, else bounded
/// Returns  true where the segment ends: dqw_segment_end_q15() must follow
/// Context  background
bool dqw_segment_block_q15(dqw_segment_q15 *s, int32_t w_q28, int32_t i_q28, uint32_t least, uint32_t most);

/// The segment ends: bands move to its scatter, sums of what agrees go on, all that was gathered is forgotten.
///
/// Source   (E104), (E105) in docs/EQUATIONS.md
/// Format   variance_q56: of a row's error, > 0
/// Returns  the weight that has changed, -1: none; then move_q24[DQW_FOLLOWED] is by how much each is to be moved
/// Cost     dqw_normal_solve_q15 of DQW_FOLLOWED inputs, twice where one has changed
/// Context  background
#define dqw_segment_end_q15 DQW_SIZED(dqw_segment_end_q15)
int dqw_segment_end_q15(dqw_segment_q15 *s, int64_t variance_q56, const dqw_segment_q15_known *known,
                        int32_t move_q24[]);

/// The smallest change of a weight that two segments would tell, Q28; INT32_MAX where the last one said nothing of it.
///
/// Source   (E105) in docs/EQUATIONS.md
/// Context  background
int32_t dqw_segment_sees_q15(const dqw_segment_q15 *s, int weight);

#ifdef __cplusplus
}
#endif
#endif
