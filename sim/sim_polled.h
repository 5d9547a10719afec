// The log as a vendor's tool writes it, (E100): polled from a host, slower than the drive's own rows.
#ifndef DQW_SIM_POLLED_H
#define DQW_SIM_POLLED_H

#include "dqw_sim.h"

/// Rows that arrive, of a run whose drive logs `count`; only for a checked scenario with polled.rate_Hz above 0.
/// O(rows).
size_t dqw_sim_polled_rows(const dqw_sim_scenario *s, size_t count);

/// Polls the drive's `count` rows into dqw_sim_polled_rows(s, count) rows. Each poll empties the drive's means, also
/// one whose reply is lost. A row: means of v_d, v_q, i_d, i_q since the last poll, all else of the poll's instant.
void dqw_sim_polled_log(const dqw_sim_scenario *s, const dqw_sim_row *drive, size_t count, dqw_sim_row *rows);

#endif
