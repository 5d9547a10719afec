#include "sim_csv.h"

#include <string.h>

int dqw_sim_csv_split(char *text, char **field)
{
    int n = 0;
    for (char *c = text; n < DQW_SIM_CSV_FIELDS; ++n) {
        char *end = c + strcspn(c, ",");
        char *next = *end ? end + 1 : NULL;
        while (c < end && (*c == ' ' || *c == '\t')) ++c;
        while (end > c && strchr(" \t\r\n", end[-1])) --end;
        *end = 0;
        field[n] = c;
        if (!next) return n + 1;
        c = next;
    }
    return n;
}

int dqw_sim_csv_header(char *text, const char *const *names, int count, int *at)
{
    char *field[DQW_SIM_CSV_FIELDS];
    if (strncmp(text, "\xef\xbb\xbf", 3) == 0) text += 3;
    const int n = dqw_sim_csv_split(text, field);
    int missing = count;
    for (int k = count - 1; k >= 0; --k) {
        at[k] = -1;
        for (int f = 0; f < n; ++f)
            if (strcmp(field[f], names[k]) == 0) at[k] = f;
        if (at[k] < 0) missing = k;
    }
    return missing;
}
