// What numbers.c measures: a step, its inputs, its start. One piece_NAME.c has them all for one thing.
#ifndef TARGET_PIECE_H
#define TARGET_PIECE_H

#include <stdint.h>

#include "target/stimulus.h"

/// Bytes of one object's state.
extern const uint32_t piece_bytes;

/// Begin anew.
void piece_start(void);

/// Make the step's inputs of a sample. Not measured.
void piece_load(const stimulus *s);

/// What is measured: the step alone, called as firmware calls it.
void piece_step(void);

/// What firmware does beside the interrupt. Not measured, but in flash.
void piece_background(void);

#endif
