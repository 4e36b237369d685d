//! Exact flow of a sigmoid contact: du/dT = 1/(1 + eᵘ) − c.
//!
//! Integrated by partial fractions from u₀ to u₀ + D, with E₀ = e^{u₀} and ρ = E₀ / (1 − c − c E₀),
//!
//! ```text
//! D + L = (1 − c) T,     L = ∫ 1/(1 + e⁻ᵘ) dT = −ln(1 − c y)/c,     y = ρ (e^D − 1)
//! ```
//!
//! The reflection u → −u, c → 1 − c maps the equation to itself, so it suffices to solve for a
//! right-hand side that is positive at u₀. Then D and L have the sign of T, nothing cancels in the
//! sum, and D keeps its relative precision however small it is. For small eᵘ, D is nearly linear in
//! T and the solver finds the root of the sum; otherwise L is, and it finds the root of D = ln(1 +
//! y(L)/ρ), L = (1 − c) T − D. Both are nearly straight there: two or three steps of Halley's
//! method suffice.

/// Beyond ±40 the logistic function is 0 or 1 to 4e-18, less than a rounding.
const SATURATED: f64 = 40.0;
/// Share of f_max below which a force is none: its motion in a step of T = 1e200 is still below a
/// rounding.
const NO_FORCE: f64 = 1e-280;
/// Largest u whose exponential, times e, is finite with room to spare.
const LARGEST_EXPONENT: f64 = 700.0;
/// Argument from which on the one in e^x − 1 or 1 + eˣ is below a rounding.
const LARGE: f64 = 38.0;
/// Largest product under a logarithm; beyond it, a sum of logarithms.
const LARGEST_PRODUCT: f64 = 1e300;
/// Halley's method leaves at most the cube of its step (in u): it stops once that is below a
/// rounding of D.
const CUBE_BELOW_ROUNDING: f64 = 1e-17;
/// Share of its terms below which a difference comes from another formula: it loses three digits at
/// most.
const CANCELLED: f64 = 1e-3;
/// A rise (in u) so short that the sum serves on both sides of the bend, and (e^SHORT − 1)/SHORT,
/// rounded up.
const SHORT: f64 = 1.5;
const SHORT_GROWTH: f64 = 2.33;
/// No progress is possible below two roundings.
const ROUNDING: f64 = 2.0 * f64::EPSILON;
/// Each step that Halley's method does not shorten halves the bracket: this number pins down any
/// double.
const MAX_ITERATIONS: usize = 120;

/// Change during the scaled time T.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(super) struct Advance {
    /// Change of u, with its sign.
    pub delta_u: f64,
    /// ∫ 1/(1 + eᵘ) d|T|: impulse of the expected force in units of f_max; ≥ 0.
    pub load: f64,
}

/// 1/(1 + eᵘ): the expected force in units of f_max.
pub(super) fn share(u: f64) -> f64 {
    let e = (-u.abs()).exp();
    if u > 0.0 {
        e / (1.0 + e)
    } else {
        1.0 / (1.0 + e)
    }
}

/// Exact solution of du/dT = 1/(1 + eᵘ) − c after the time `t`, which may be negative.
///
/// All arguments finite; no result is NaN.
pub(super) fn advance(u: f64, c: f64, t: f64) -> Advance {
    let c = if c.abs() < NO_FORCE { 0.0 } else { c };
    let arc = Arc::new(u, c, 1.0 - c);
    if arc.rate >= 0.0 {
        let (rise, low, _) = arc.after(t);
        Advance {
            delta_u: rise.copysign(t),
            load: low,
        }
    } else {
        let (rise, _, high) = Arc::new(-u, 1.0 - c, c).after(t);
        Advance {
            delta_u: -rise.copysign(t),
            load: high,
        }
    }
}

/// A start from which u rises while T grows.
#[derive(Clone, Copy)]
struct Arc {
    u: f64,
    c: f64,
    /// 1 − c, separate because the difference would lose it for c near 1.
    rest: f64,
    /// E₀
    e: f64,
    /// 1/(1 + E₀) − c > 0
    rate: f64,
    /// E₀ / (1 − c − c E₀) > 0
    rho: f64,
}

/// |D|, ∫ 1/(1 + eᵘ) d|T|, ∫ 1/(1 + e⁻ᵘ) d|T|.
type FlowIntegrals = (f64, f64, f64);

impl Arc {
    #[inline]
    fn new(u: f64, c: f64, rest: f64) -> Self {
        let small = (-u.abs()).exp();
        let (e, margin) = if u > 0.0 {
            (1.0 / small, rest * small - c)
        } else {
            (small, rest - c * small)
        };
        let rho = if u > 0.0 {
            1.0 / margin
        } else {
            small / margin
        };
        Self {
            u,
            c,
            rest,
            e,
            rate: margin / (1.0 + small),
            rho,
        }
    }

    /// Straight parts first, if they reach that far, then the curved one.
    #[inline]
    fn after(self, t: f64) -> FlowIntegrals {
        let (span, down) = (t.abs(), t < 0.0);
        if self.u < -SATURATED {
            let edge = self.rest.min(1.0).ln() - SATURATED;
            if self.u < edge {
                return self.straight(span, down, self.rest, (!down).then_some(edge));
            }
        } else if self.u > SATURATED && self.c < 0.0 {
            let edge = SATURATED - (-self.c).min(1.0).ln();
            if self.u > edge {
                return self.straight(span, down, -self.c, down.then_some(edge));
            }
        }
        if self.u > LARGEST_EXPONENT {
            return self.without_force(t);
        }
        self.curved(span, down)
    }

    /// u moves at the constant `slope`, at most to the `edge`; the rest of the time goes on from
    /// there.
    fn straight(self, span: f64, down: bool, slope: f64, edge: Option<f64>) -> FlowIntegrals {
        let sign = if down { -1.0 } else { 1.0 };
        let free = self.u + sign * slope * span;
        let edge = edge.filter(|&edge| sign * (free - edge) > 0.0);
        let (displacement, spent) = edge.map_or((slope * span, span), |edge| {
            let displacement = (edge - self.u).abs();
            (displacement, (displacement / slope).min(span))
        });
        // the vanishing one of the two integrals: the exponential tail between both ends
        let nearest = self.u.abs().min(edge.unwrap_or(free).abs());
        let tail = -(-displacement).exp_m1() * (-nearest).exp() / slope;
        let here = if self.u < 0.0 {
            (displacement, spent, tail)
        } else {
            (displacement, tail, spent)
        };
        let Some(edge) = edge else { return here };
        let left = Self::new(edge, self.c, self.rest).after(sign * (span - spent));
        (here.0 + left.0, here.1 + left.1, here.2 + left.2)
    }

    /// c = 0 and E₀ beyond the largest number: e^u grows linearly.
    fn without_force(self, t: f64) -> FlowIntegrals {
        let rise = (t * (-self.u).exp()).ln_1p().abs();
        (rise, rise, t.abs())
    }

    fn curved(self, span: f64, down: bool) -> FlowIntegrals {
        let sign = if down { -1.0 } else { 1.0 };
        let total = self.rest * span;
        // the rate falls while u rises
        let (low, high) = if down {
            (self.rate * span, total)
        } else {
            (0.0, total.min(self.rate * span))
        };
        let start = if down { low } else { self.guess(span, high) };
        let short = !down && high <= SHORT && self.c * self.rho * SHORT_GROWTH * high < 0.5;
        let by_sum = |displacement| self.by_sum(sign, total, displacement);
        let Some(bend) = self.bend().filter(|_| !short) else {
            return self.passed(solve(low, high, start, by_sum), total, span, sign);
        };
        let to_bend = if down == (self.e < bend) {
            0.0
        } else {
            (bend / self.e).ln().abs()
        };
        let beyond = to_bend == 0.0
            || (to_bend < high && to_bend + self.high_and_end(sign * to_bend).0 < total);
        let (low, high) = if beyond {
            (low.max(to_bend), high)
        } else {
            (low, high.min(to_bend))
        };
        let displacement = if beyond != down {
            // L must not start near 0 while eᵘ is small: its logarithm is steep there
            let start = if self.e < bend { low } else { start };
            solve(low, high, start, |displacement| {
                self.by_logarithm(sign, total, displacement)
            })
        } else {
            solve(low, high, start, by_sum)
        };
        self.passed(displacement, total, span, sign)
    }

    /// D of a short or straight rise: (2, 1) Padé approximation of the decaying rate; at most
    /// `high`.
    #[inline]
    fn guess(&self, span: f64, high: f64) -> f64 {
        let decay = self.e / ((1.0 + self.e) * (1.0 + self.e)) * span;
        (self.rate * span / (1.0 + 0.5 * decay)).min(high)
    }

    /// Value of eᵘ up to which D, and from which on L, is nearly linear in T; `None`: D always is.
    #[inline]
    fn bend(&self) -> Option<f64> {
        if self.c <= -1.0 {
            None
        } else if self.c > 0.0 {
            Some((0.5 * self.rest / self.c).min(1.0))
        } else {
            Some(1.0)
        }
    }

    /// D + L − (1 − c) T as a function of D.
    #[inline]
    fn by_sum(&self, sign: f64, total: f64, displacement: f64) -> (f64, f64, f64) {
        let (high, e) = self.high_and_end(sign * displacement);
        let l = 1.0 / (self.rest / e - self.c);
        (
            displacement + high - total,
            1.0 + l,
            sign * l * (1.0 + self.c * l) / (1.0 + l),
        )
    }

    /// D − ln(1 + y(L)/ρ) with L = (1 − c) T − D, as a function of D.
    #[inline]
    fn by_logarithm(&self, sign: f64, total: f64, displacement: f64) -> (f64, f64, f64) {
        let x = -self.c * sign * (total - displacement);
        let (mapped, m) = if x > LARGE && self.c < 0.0 {
            // 1 + y/ρ overflows or nearly so, its logarithm does not
            (x - (-self.c * self.rho).ln(), -self.c)
        } else if sign < 0.0 && self.c < 0.0 {
            // 1 + y/ρ nearly cancels while u is large, 1 + z does not
            let grown = if -x < f64::EPSILON {
                total - displacement
            } else {
                (-x).exp_m1() / -self.c
            };
            let z = -grown * self.rest / self.e;
            (x + z.ln_1p(), 1.0 / (self.rho * (1.0 + z)))
        } else {
            let grown = x.exp_m1();
            let y = if x.abs() < f64::EPSILON {
                sign * (total - displacement)
            } else {
                grown / -self.c
            };
            ((y / self.rho).ln_1p(), (1.0 + grown) / (self.rho + y))
        };
        let residual = displacement - sign * mapped;
        // D too small on the descent: the logarithm does not exist there
        let residual = if residual.is_finite() {
            residual
        } else {
            -f64::MAX
        };
        (residual, 1.0 + m, sign * m * (self.c + m) / (1.0 + m))
    }

    /// |L| = ∫ 1/(1 + e⁻ᵘ) d|T|, from the lower end so that nothing cancels, and eᵘ after the
    /// signed change `d` of u.
    #[inline]
    fn high_and_end(&self, d: f64) -> (f64, f64) {
        let grown = d.exp_m1();
        let (y, e) = if d < 0.0 {
            let e = self.e * d.exp();
            (-self.e * grown / (self.rest - self.c * e), e)
        } else {
            (self.rho * grown, self.e * (1.0 + grown))
        };
        let x = -self.c * y;
        let high = if x.abs() < f64::EPSILON {
            y
        } else if x < LARGEST_PRODUCT {
            x.ln_1p() / -self.c
        } else {
            (d + ((-d).exp() - self.c * self.rho).ln()) / -self.c
        };
        (high, e)
    }

    /// Both integrals: from the sums D + L = (1 − c) T and ∫ 1/(1 + eᵘ) d|T| = |D| + c |T| unless
    /// they cancel.
    #[inline]
    fn passed(&self, displacement: f64, total: f64, span: f64, sign: f64) -> FlowIntegrals {
        let (low, high) = (displacement + self.c * span, total - displacement);
        let low = if low > CANCELLED * displacement {
            low
        } else {
            self.low(displacement, sign)
        };
        let high = if high > CANCELLED * total {
            high
        } else {
            self.high_and_end(sign * displacement).0
        };
        (displacement, low, high)
    }

    /// ∫ 1/(1 + eᵘ) d|T| = (|D| + ln((1−c−cE)/(1−c−cE′)))/(1−c) for c ≤ 0, from the lower end E to
    /// the upper end E′.
    #[inline]
    fn low(&self, displacement: f64, sign: f64) -> f64 {
        let shrunk = (-displacement).exp();
        let e = if sign < 0.0 { self.e * shrunk } else { self.e };
        let lower = self.rest - self.c * e;
        let x = self.rest * (-displacement).exp_m1() / lower;
        if x > -0.5 {
            -x.ln_1p() / self.rest
        } else if sign < 0.0 {
            (displacement + (lower / (self.rest - self.c * self.e)).ln()) / self.rest
        } else {
            (lower / (self.rest * shrunk - self.c * e)).ln() / self.rest
        }
    }
}

/// Halley's method for the distance |D|, kept between `low` and `high` by bisection.
///
/// `equation`: residual, slope, and second derivative over slope, all for the distance.
#[inline]
fn solve(
    mut low: f64,
    mut high: f64,
    start: f64,
    equation: impl Fn(f64) -> (f64, f64, f64),
) -> f64 {
    let mut displacement = start.max(low).min(high); // rounding may cross the two
    for _ in 0..MAX_ITERATIONS {
        let (residual, slope, bend) = equation(displacement);
        if residual > 0.0 {
            high = displacement
        } else {
            low = displacement
        }
        let newton = residual / slope;
        let step = newton / (1.0 - 0.5 * newton * bend).max(0.5);
        let next = displacement - step;
        let inside = next >= low && next <= high;
        if inside
            && (step * step * step.abs() <= CUBE_BELOW_ROUNDING * displacement
                || step.abs() <= ROUNDING * displacement)
        {
            return next;
        }
        if !inside && (high - low <= ROUNDING * high || step.abs() <= ROUNDING * displacement) {
            return displacement;
        }
        displacement = if inside { next } else { 0.5 * (low + high) };
    }
    displacement
}
