// A log's CSV on stdin to v_d, v_q, i_d, i_q, w_m, theta_e as floats on stdout. Columns in the order of dqwatch sim.
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

int main(void)
{
    static char line[1024];
    if (fgets(line, sizeof line, stdin) == NULL ||
        strncmp(line, "t_s,v_d_V,v_q_V,i_d_A,i_q_A,w_m_rad_s,theta_e_rad,", 50) != 0)
        return 1;
    while (fgets(line, sizeof line, stdin) != NULL) {
        char *at = line;
        (void)strtof(at, &at);
        for (int i = 0; i < 6; i++) {
            const float x = *at == ',' ? strtof(at + 1, &at) : 0.0f;
            if (fwrite(&x, sizeof x, 1, stdout) != 1) return 1;
        }
    }
    return 0;
}
