/* The C library's functions of complex numbers, which wine 8 has not written yet and numpy calls.
 *
 * Microsoft hands a complex number on as a structure of two; these take and return such ones and
 * compute with the compiler's own. All else of ucrtbase.dll is passed on to wine's. */
#include <complex.h>

#define FUNCTIONS(SUFFIX, REAL)                                                                    \
    typedef struct {                                                                               \
        REAL re, im;                                                                               \
    } pair##SUFFIX;                                                                                \
    static REAL _Complex joined##SUFFIX(pair##SUFFIX z) {                                          \
        REAL _Complex whole;                                                                       \
        __real__ whole = z.re;                                                                     \
        __imag__ whole = z.im;                                                                     \
        return whole;                                                                              \
    }                                                                                              \
    static pair##SUFFIX parted##SUFFIX(REAL _Complex z) {                                          \
        pair##SUFFIX two = {__real__ z, __imag__ z};                                               \
        return two;                                                                                \
    }

FUNCTIONS(f, float)
FUNCTIONS(d, double)

#define OF_ONE(NAME, SUFFIX, CALL)                                                                 \
    pair##SUFFIX own_##NAME(pair##SUFFIX z) { return parted##SUFFIX(CALL(joined##SUFFIX(z))); }
#define OF_TWO(NAME, SUFFIX, CALL)                                                                 \
    pair##SUFFIX own_##NAME(pair##SUFFIX z, pair##SUFFIX w) {                                      \
        return parted##SUFFIX(CALL(joined##SUFFIX(z), joined##SUFFIX(w)));                         \
    }
#define TO_REAL(NAME, SUFFIX, REAL, CALL)                                                          \
    REAL own_##NAME(pair##SUFFIX z) { return CALL(joined##SUFFIX(z)); }

/* A long double of Microsoft's is a double. */
#define ALL_OF_ONE(NAME) OF_ONE(NAME##f, f, NAME##f) OF_ONE(NAME, d, NAME) OF_ONE(NAME##l, d, NAME)
#define ALL_OF_TWO(NAME) OF_TWO(NAME##f, f, NAME##f) OF_TWO(NAME, d, NAME) OF_TWO(NAME##l, d, NAME)
#define ALL_TO_REAL(NAME)                                                                          \
    TO_REAL(NAME##f, f, float, NAME##f)                                                            \
    TO_REAL(NAME, d, double, NAME)                                                                 \
    TO_REAL(NAME##l, d, double, NAME)

ALL_OF_ONE(cexp)
ALL_OF_ONE(clog)
ALL_OF_ONE(csqrt)
ALL_OF_ONE(csin)
ALL_OF_ONE(ccos)
ALL_OF_ONE(ctan)
ALL_OF_ONE(csinh)
ALL_OF_ONE(ccosh)
ALL_OF_ONE(ctanh)
ALL_OF_ONE(casin)
ALL_OF_ONE(cacos)
ALL_OF_ONE(catan)
ALL_OF_TWO(cpow)
ALL_TO_REAL(creal)
ALL_TO_REAL(cimag)
ALL_TO_REAL(carg)
ALL_TO_REAL(cabs)
