//! What may be wrong with a force, as unknowns.

use nalgebra::{Matrix3, Rotation3, SMatrix, SVector, UnitQuaternion, Vector3};
use touchup_method::stylus::ChangeCourse;

/// Most unknowns of a fault.
pub(super) const FAULT_FREEDOMS: usize = 8;

/// Unknowns of a fault.
pub(crate) type FaultNumbers = SVector<f64, FAULT_FREEDOMS>;

type FaultMatrix = SMatrix<f64, 3, FAULT_FREEDOMS>;

/// What is wrong with a measured force, in the axes T of the stylus.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum ForceFault {
    /// It is turned: F = Q f, with the rotation vector of Q, rad.
    Turned,
    /// Its axes have other gains, or read into each other: F = (I + D) f, with D by rows but for the
    /// last number, which makes the trace zero: a gain of all axes turns no force.
    Gains,
    /// Its zero is another one: F = f − b, N.
    Zero,
    /// Its zero is another one and changes: F = f − b − s(t) c, N.
    ZeroChanged(ChangeCourse),
    /// A weight is in it besides: F = f − b − Rᵀ w, with w in O, N.
    Weight,
}

/// A measured force, and what turns it.
#[derive(Clone, Copy, Debug)]
pub(super) struct MeasuredForce {
    pub stamp_ns: i64,
    /// T to O
    pub rotation: UnitQuaternion<f64>,
    /// N, in T
    pub force: Vector3<f64>,
}

impl ForceFault {
    /// Number of its unknowns, the first ones.
    pub(crate) fn freedoms(self) -> usize {
        match self {
            Self::Turned | Self::Zero => 3,
            Self::ZeroChanged(_) | Self::Weight => 6,
            Self::Gains => 8,
        }
    }

    /// Whether the zero of the sensor is wrong, and not how it reads a force.
    pub(crate) fn is_of_zero(self) -> bool {
        match self {
            Self::Turned | Self::Gains => false,
            Self::Zero | Self::ZeroChanged(_) | Self::Weight => true,
        }
    }

    /// Standard uncertainties of the unknowns before the forces: whatever these show.
    ///
    /// - `largest`: force, N.
    pub(crate) fn prior(self, largest: f64) -> FaultNumbers {
        let usual = if self.is_of_zero() { largest } else { 1.0 };
        FaultNumbers::from_fn(|at, _| if at < self.freedoms() { usual } else { 1e-9 })
    }

    /// The force with the fault taken off, N, in T.
    pub(super) fn undone(self, measured: &MeasuredForce, numbers: &FaultNumbers) -> Vector3<f64> {
        let [first, second] = [0, 3].map(|from| numbers.fixed_rows::<3>(from).into_owned());
        let force = measured.force;
        match self {
            Self::Turned => Rotation3::new(first) * force,
            Self::Gains => force + without_trace(numbers) * force,
            Self::Zero => force - first,
            Self::ZeroChanged(course) => force - first - second * course.share(measured.stamp_ns),
            Self::Weight => force - first - measured.rotation.inverse() * second,
        }
    }

    /// Derivatives of that force by the unknowns; of a turn, by a further small one.
    pub(super) fn derivatives(
        self,
        measured: &MeasuredForce,
        numbers: &FaultNumbers,
    ) -> FaultMatrix {
        let mut by = FaultMatrix::zeros();
        let set = |by: &mut FaultMatrix, from: usize, block: Matrix3<f64>| {
            by.fixed_columns_mut::<3>(from).copy_from(&block);
        };
        match self {
            Self::Turned => set(&mut by, 0, -self.undone(measured, numbers).cross_matrix()),
            Self::Gains => {
                for at in 0..FAULT_FREEDOMS {
                    let of = without_trace(&FaultNumbers::ith(at, 1.0));
                    by.set_column(at, &(of * measured.force));
                }
            }
            Self::Zero => set(&mut by, 0, -Matrix3::identity()),
            Self::ZeroChanged(course) => {
                set(&mut by, 0, -Matrix3::identity());
                set(
                    &mut by,
                    3,
                    -Matrix3::identity() * course.share(measured.stamp_ns),
                );
            }
            Self::Weight => {
                set(&mut by, 0, -Matrix3::identity());
                let back = measured.rotation.inverse().to_rotation_matrix();
                set(&mut by, 3, -back.matrix());
            }
        }
        by
    }

    /// The unknowns after a small step.
    pub(super) fn moved(self, numbers: &FaultNumbers, step: &FaultNumbers) -> FaultNumbers {
        let mut moved = numbers + step;
        if self == Self::Turned {
            let [turn, further] =
                [numbers, step].map(|of| Rotation3::new(of.fixed_rows::<3>(0).into_owned()));
            moved
                .fixed_rows_mut::<3>(0)
                .copy_from(&(further * turn).scaled_axis());
        }
        moved
    }
}

/// Eight numbers of a matrix by rows, and a ninth that makes its trace zero.
pub(crate) fn without_trace(numbers: &FaultNumbers) -> Matrix3<f64> {
    let last = -numbers[0] - numbers[4];
    Matrix3::from_row_iterator(numbers.iter().copied().chain([last]))
}
