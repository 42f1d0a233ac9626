/* A number that counts its operations; generated C is compiled as C++ with it as the real type. */
#ifndef COUNTED_HPP
#define COUNTED_HPP

#include <math.h>

extern unsigned long long operations;

struct counted {
    double v;
    counted() = default;
    counted(double x) : v(x) {}
};

#define COUNTED_BINARY(op)                                     \
    inline counted operator op(counted a, counted b) {         \
        ++operations;                                          \
        return counted(a.v op b.v);                            \
    }                                                          \
    inline counted &operator op## = (counted & a, counted b) { \
        ++operations;                                          \
        a.v op## = b.v;                                        \
        return a;                                              \
    }
#define COUNTED_COMPARISON(op) \
    inline bool operator op(counted a, counted b) { return a.v op b.v; }
#define COUNTED_CALL(f)           \
    inline counted f(counted a) { \
        ++operations;             \
        return counted(::f(a.v)); \
    }

#define COUNTED_CALL_OF_TWO(f)               \
    inline counted f(counted a, counted b) { \
        ++operations;                        \
        return counted(::f(a.v, b.v));       \
    }

inline counted operator-(counted a) { return counted(-a.v); }
inline counted fabs(counted a) { return counted(::fabs(a.v)); }

COUNTED_BINARY(+)
COUNTED_BINARY(-)
COUNTED_BINARY(*)
COUNTED_BINARY(/)
COUNTED_COMPARISON(<)
COUNTED_COMPARISON(>)
COUNTED_COMPARISON(<=)
COUNTED_COMPARISON(>=)
COUNTED_COMPARISON(==)
COUNTED_COMPARISON(!=)
COUNTED_CALL(sqrt)
COUNTED_CALL(sin)
COUNTED_CALL(cos)
COUNTED_CALL(tan)
COUNTED_CALL(exp)
COUNTED_CALL(log)
COUNTED_CALL(asin)
COUNTED_CALL(acos)
COUNTED_CALL(atan)
COUNTED_CALL(sinh)
COUNTED_CALL(cosh)
COUNTED_CALL(tanh)
COUNTED_CALL(asinh)
COUNTED_CALL(acosh)
COUNTED_CALL(atanh)
COUNTED_CALL(floor)
COUNTED_CALL(ceil)
COUNTED_CALL_OF_TWO(pow)
COUNTED_CALL_OF_TWO(atan2)
COUNTED_CALL_OF_TWO(fmod)
COUNTED_CALL_OF_TWO(fmin)
COUNTED_CALL_OF_TWO(fmax)

#endif
