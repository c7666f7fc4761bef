// error/classes.glsl — error classes, half an octave each: class c is every error above span · 2^(−c/2 − 1/2).
//   "No node in this rectangle is above class c" is one count equal to zero (integral histogram, Porikli 2005).
//   Class 0 is the largest errors; CLASSES − 1 the smallest that is told apart from "smaller still".
// Provides class_limit_m(), counters laid out two classes a word.

#ifndef CLASSES
#define CLASSES 40
#endif
#ifndef COUNT_TILE
#define COUNT_TILE 4
#endif

float class_limit_m(int c) { return u_span_m * exp2(-0.5 * float(c) - 0.5); }

// The largest error limit that the classes know below an error, as a class; CLASSES if there is none.
int class_below(float e_m) {
    int c = int(ceil(-2.0 * log2(e_m / u_span_m) - 1.0));
    c = clamp(c, 0, CLASSES);
    while (c < CLASSES && class_limit_m(c) > e_m) c++;
    return c;
}
