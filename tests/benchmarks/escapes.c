/* Periods until trajectories reach an ellipse of the section, one after another: what a careful C program costs.
 *
 * Usage: escapes TRAJECTORIES SEED INTENSITY X V TARGET_X TARGET_V R00 R01 R10 R11
 * Each starts at (X, V) and ends where |R (q - TARGET)| <= 1 at a section. Prints nanoseconds in all, then the sum and
 * the sum of squares of the periods taken. */
#define ESCAPES
#include "stochastic_step.c"

int main(int count, char **argument) {
    if (count != 12) return fprintf(stderr, "usage: escapes TRAJECTORIES SEED INTENSITY X V TARGET R\n"), 2;
    long trajectories = atol(argument[1]);
    double number[9];
    for (int i = 0; i < 9; i++) number[i] = strtod(argument[3 + i], NULL);
    const double *target = number + 3, *r = number + 5;
    static Steps steps;
    Stream s = prepare(&steps, number[0], strtoull(argument[2], NULL, 10));
    double sum = 0.0, squares = 0.0;
    struct timespec start;

    clock_gettime(CLOCK_MONOTONIC, &start);
    for (long n = 0; n < trajectories; n++) {
        double x = number[1], v = number[2], periods = 0.0;
        for (int reached = 0; !reached; periods += 1.0) {
            period(&x, &v, &steps, &s);
            double dx = x - target[0], dv = v - target[1];
            reached = hypot(r[0] * dx + r[1] * dv, r[2] * dx + r[3] * dv) <= 1.0;
        }
        sum += periods;
        squares += periods * periods;
    }
    printf("%.0f %.17g %.17g\n", nanoseconds_since(&start), sum, squares);
    return 0;
}
