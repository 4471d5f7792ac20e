/* One noisy RK4 step after another, one trajectory at a time: what a careful C program costs.
 *
 * Usage: stochastic_step TRAJECTORIES PERIODS SEED   (256 steps per period of the forcing)
 * Prints nanoseconds per trajectory-step, then mean and standard deviation of the final position.
 * xoshiro256++ (Blackman & Vigna) feeds a ziggurat of 256 layers (Marsaglia & Tsang, Doornik's layout). */
#include <math.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <time.h>

#define STEPS 256
#define LAYERS 256
static const double PI = 3.14159265358979323846;
static const double DAMPING = 0.02, STIFFNESS = 50.0, GAP = 0.5; /* 2 zeta omega; omega = 1 */
static const double AMPLITUDE = 0.18, FREQUENCY = 0.57, CONSTANT = 0.2;

/* Layer i lies under the density between heights f[i] and f[i+1] and is edge[i] wide; layer 0 is the base. */
static double edge[LAYERS + 1], height[LAYERS + 1], width[LAYERS];
static uint64_t inside[LAYERS];
static const double TAIL = 3.6541528853610088, AREA = 0.00492867323399;

typedef struct { uint64_t a, b, c, d; } Stream;

static inline uint64_t rotate(uint64_t x, int k) { return (x << k) | (x >> (64 - k)); }

static inline uint64_t draw(Stream *s) {
    uint64_t word = rotate(s->a + s->d, 23) + s->a, t = s->b << 17;
    s->c ^= s->a;
    s->d ^= s->b;
    s->b ^= s->c;
    s->a ^= s->d;
    s->c ^= t;
    s->d = rotate(s->d, 45);
    return word;
}

static inline double uniform(Stream *s) { return ((double)(draw(s) >> 11) + 0.5) * 0x1p-53; }

static uint64_t split_mix(uint64_t *seed) {
    uint64_t z = *seed += 0x9E3779B97F4A7C15u;
    z = (z ^ (z >> 30)) * 0xBF58476D1CE4E5B9u;
    z = (z ^ (z >> 27)) * 0x94D049BB133111EBu;
    return z ^ (z >> 31);
}

static void build_tables(void) {
    edge[0] = AREA / exp(-0.5 * TAIL * TAIL); /* the base, its tail drawn as if it were a strip */
    edge[1] = TAIL;
    for (int i = 2; i < LAYERS; i++)
        edge[i] = sqrt(-2.0 * log(AREA / edge[i - 1] + exp(-0.5 * edge[i - 1] * edge[i - 1])));
    edge[LAYERS] = 0.0;
    for (int i = 0; i <= LAYERS; i++) height[i] = exp(-0.5 * edge[i] * edge[i]);
    for (int i = 0; i < LAYERS; i++) {
        width[i] = edge[i] * 0x1p-53;
        inside[i] = (uint64_t)(edge[i + 1] / edge[i] * 0x1p53);
    }
}

static double from_tail(Stream *s) {
    double x, y;
    do {
        x = -log(uniform(s)) / TAIL;
        y = -log(uniform(s));
    } while (y + y < x * x);
    return TAIL + x;
}

static __attribute__((noinline)) double seldom(Stream *s, uint64_t word) {
    for (;; word = draw(s)) {
        int layer = word & (LAYERS - 1);
        double sign = word & LAYERS ? -1.0 : 1.0;
        uint64_t place = word >> 11;
        double x = (double)place * width[layer];
        if (place < inside[layer]) return sign * x;
        if (layer == 0) return sign * from_tail(s);
        if (height[layer] + uniform(s) * (height[layer + 1] - height[layer]) < exp(-0.5 * x * x)) return sign * x;
    }
}

static inline double normal(Stream *s) {
    uint64_t word = draw(s), place = word >> 11; /* bits 0-7 layer, 8 sign, 11-63 place */
    int layer = word & (LAYERS - 1);
    if (__builtin_expect(place >= inside[layer], 0)) {
        Stream copy = *s; /* so that the stream itself stays in registers */
        double x = seldom(&copy, word);
        *s = copy;
        return x;
    }
    double x = (double)place * width[layer];
    uint64_t bits;
    memcpy(&bits, &x, 8);
    bits |= (word & LAYERS) << 55; /* the sign, without a branch */
    memcpy(&x, &bits, 8);
    return x;
}

static inline double drift(double x, double v, double forcing) {
    double free_flight = forcing - DAMPING * v - x, depth = fabs(x) - GAP;
    if (depth <= 0.0) return free_flight; /* a predicted branch costs less than waiting for a square root */
    return free_flight - copysign(STIFFNESS * depth * sqrt(depth), x);
}

typedef struct { double length, half_kick, forcing[2 * STEPS + 1]; } Steps;

static Stream prepare(Steps *steps, double intensity, uint64_t seed) {
    build_tables();
    steps->length = 2.0 * PI / FREQUENCY / STEPS;
    steps->half_kick = 0.5 * sqrt(intensity * steps->length);
    for (int i = 0; i <= 2 * STEPS; i++) steps->forcing[i] = AMPLITUDE * cos(FREQUENCY * i * steps->length / 2) + CONSTANT;
    Stream s;
    s.a = split_mix(&seed), s.b = split_mix(&seed), s.c = split_mix(&seed), s.d = split_mix(&seed);
    return s;
}

static inline void period(double *position, double *velocity, const Steps *steps, Stream *s) {
    double x = *position, v = *velocity, h = steps->length, half = steps->half_kick;
    for (long step = 0; step < STEPS; step++) {
        const double *f = steps->forcing + 2 * step;
        double u = normal(s), w = normal(s) * 0.57735026918962576;
        v += half * (u + w);
        double x1 = v, v1 = drift(x, v, f[0]);
        double x2 = v + 0.5 * h * v1, v2 = drift(x + 0.5 * h * x1, x2, f[1]);
        double x3 = v + 0.5 * h * v2, v3 = drift(x + 0.5 * h * x2, x3, f[1]);
        double x4 = v + h * v3, v4 = drift(x + h * x3, x4, f[2]);
        x += h / 6.0 * (x1 + 2.0 * (x2 + x3) + x4);
        v += h / 6.0 * (v1 + 2.0 * (v2 + v3) + v4) + half * (u - w);
    }
    *position = x, *velocity = v;
}

static double nanoseconds_since(const struct timespec *start) {
    struct timespec stop;
    clock_gettime(CLOCK_MONOTONIC, &stop);
    return 1e9 * (double)(stop.tv_sec - start->tv_sec) + (double)(stop.tv_nsec - start->tv_nsec);
}

#ifndef ESCAPES /* escapes.c has a main of its own */
int main(int count, char **argument) {
    if (count != 4) return fprintf(stderr, "usage: stochastic_step TRAJECTORIES PERIODS SEED\n"), 2;
    long trajectories = atol(argument[1]), periods = atol(argument[2]);
    static Steps steps;
    Stream s = prepare(&steps, 2e-5, strtoull(argument[3], NULL, 10));
    double sum = 0.0, squares = 0.0;
    struct timespec start;

    clock_gettime(CLOCK_MONOTONIC, &start);
    for (long n = 0; n < trajectories; n++) {
        double x = 0.0, v = 0.0;
        for (long k = 0; k < periods; k++) period(&x, &v, &steps, &s);
        sum += x;
        squares += x * x;
    }
    double nanoseconds = nanoseconds_since(&start), mean = sum / (double)trajectories;
    printf("%.6f %.17g %.17g\n", nanoseconds / ((double)trajectories * (double)periods * STEPS), mean,
           sqrt(fmax(squares / (double)trajectories - mean * mean, 0.0)));
    return 0;
}
#endif
