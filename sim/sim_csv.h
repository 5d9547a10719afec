// One line of a CSV file in its fields.
#ifndef DQW_SIM_CSV_H
#define DQW_SIM_CSV_H

enum { DQW_SIM_CSV_FIELDS = 32, DQW_SIM_CSV_LINE = 4096 };

/// Splits at commas, in place; trims spaces and a carriage return. Returns the number of fields, DQW_SIM_CSV_FIELDS at
/// most.
int dqw_sim_csv_split(char *text, char **field);

/// Where in the header line each of `names` stands, -1 where it does not. Returns the first that is missing, or
/// `count`.
int dqw_sim_csv_header(char *text, const char *const *names, int count, int *at);

#endif
