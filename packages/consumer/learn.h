/* Learns a simulated motor with an installed dqwatch, in the arithmetic of the file that is linked. */
#ifndef LEARN_H
#define LEARN_H

#ifdef __cplusplus
extern "C" {
#endif

/* `say` is told the version first, then each parameter beside the truth. Returns 0 where all are usable and within 0.5 %. */
int learn(void (*say)(const char *what, float value, float truth));

#ifdef __cplusplus
}
#endif
#endif
