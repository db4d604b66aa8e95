#pragma once
// Elementary functions of doubles out of additions, multiplications, divisions and square roots, which IEEE 754 rounds
// the same everywhere. Those of a C library differ between machines, and even on one machine with what its processor
// can do. Errors are in units in the last place (ulp) of the result, measured against the C library; not-a-number goes
// through.

namespace plumb::exact {

/// At most 2 ulp, and 2e-16 near the zeros beyond the first, for |x| <= 1e5; not-a-number beyond, and for infinity.
double sin(double x);
double cos(double x);
/// At most 4 ulp where sin and cos are at most 2.
double tan(double x);

/// At most 2 ulp.
double atan(double x);
/// Angle of (x, y) in [-pi, pi]; at most 3 ulp; 0 when both are 0, and not-a-number when both are infinite.
double atan2(double y, double x);

/// At most 2 ulp. 0 below -708, where the result would lose bits, and infinity above 709.
double exp(double x);
/// At most 2 ulp. Not-a-number for what is not positive, finite and normal.
double log(double x);

/// Complement of the error function for x >= 0; relative error at most 1e-12. 0 from 26 on.
double erfc(double x);

/// sqrt(a^2 + b^2); at most 2 ulp while the squares neither overflow nor underflow.
double hypot(double a, double b);

}  // namespace plumb::exact
