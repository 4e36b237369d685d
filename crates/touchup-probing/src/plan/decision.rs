//! A decision as the goal of a search: touches go on until each characteristic of the feature
//! passes or fails.
//!
//! A characteristic with a distance d of its value from the nearest limit is decided at a standard
//! uncertainty u of d/z, with a guard band of z u. So the search requests d/z of an open number,
//! and nothing of numbers that are decided, or that no touch decides. As there is a look after each
//! touch, z is the quantile of repeated looks ([`repeated_confidence`]).

use nalgebra::Point3;

use super::search_context::OpenNumbers;
use touchup_features::conformity::{
    Assessment, Decision, DecisionParams, MeasuredNumber, ToleranceLimits, assess, measured_number,
    repeated_confidence,
};
use touchup_features::features::{Feature, FeatureKind, InspectedQuantity};
use touchup_geometry::numeric::normal_quantile;

/// A characteristic to decide.
#[derive(Clone, Debug, PartialEq)]
pub struct SoughtCharacteristic {
    /// name in the drawing
    pub name: String,
    /// quantity of the feature
    pub quantity: InspectedQuantity,
    /// limits, m
    pub limits: ToleranceLimits,
    /// centre of the feature in the drawing, m in O; required for a position
    pub nominal: Option<Point3<f64>>,
}

/// Decisions as the goal of probing a feature.
#[derive(Clone, Debug, PartialEq)]
pub struct DecisionGoal {
    /// all characteristics, of one feature
    pub characteristics: Vec<SoughtCharacteristic>,
    /// decision rule; its confidence is for all looks together
    pub params: DecisionParams,
}

/// A characteristic after some touches.
#[derive(Clone, Debug, PartialEq)]
pub struct DecidedCharacteristic {
    /// the characteristic
    pub sought: SoughtCharacteristic,
    /// measured value, m; `None` while the touches do not fix it
    pub measured: Option<MeasuredNumber>,
    /// part of its standard uncertainty common to all touches, m
    pub shared: f64,
    /// decision, with the guard bands of repeated looks
    pub assessment: Assessment,
    /// whether any number of touches leaves it open
    pub is_limited: bool,
}

/// Uncertainty by touches over the common uncertainty, below which more touches add a twentieth at
/// most.
const LEAST_SHARE: f64 = 1.0 / 3.0;
/// Maximum shift of a value by more touches, in standard deviations of the present touches.
const MOVES: f64 = 3.0;
/// Values tried on either side within this shift.
const TRIED: i32 = 12;
/// Least requested deviation of a number over its present one: it may move away from its limit.
const LEAST_STEP: f64 = 0.25;
/// Minimum number of touches for a credible surface, and so for a first look.
const FEWEST: usize = 6;

impl DecisionGoal {
    /// Whether touches exist for a quantity of a kind.
    pub fn decides(kind: FeatureKind, quantity: InspectedQuantity) -> bool {
        use InspectedQuantity::{Diameter, Length, Position, Width, X, Y, Z};
        match quantity {
            X | Y | Z => !matches!(
                kind,
                FeatureKind::Corner
                    | FeatureKind::Cylinder
                    | FeatureKind::Notch
                    | FeatureKind::Sphere
            ),
            Position => matches!(
                kind,
                FeatureKind::Hole | FeatureKind::Slot | FeatureKind::Pocket | FeatureKind::Boss
            ),
            Diameter => matches!(kind, FeatureKind::Hole | FeatureKind::Boss),
            Width | Length => matches!(kind, FeatureKind::Slot | FeatureKind::Pocket),
            _ => false,
        }
    }

    /// Decision rule of one look among many.
    ///
    /// - `budget`: maximum number of touches of the feature.
    pub(super) fn of_one_look(&self, budget: usize) -> DecisionParams {
        DecisionParams {
            confidence: repeated_confidence(self.params.confidence, FEWEST, budget),
            ..self.params
        }
    }

    /// State of each characteristic after the touches.
    ///
    /// - `feature`: with its full uncertainty, and with that of its touches alone; `None` if they
    ///   do not fix its shape, and then nothing is decided.
    pub(super) fn standing(
        &self,
        params: &DecisionParams,
        feature: Option<(&Feature, &Feature)>,
    ) -> Vec<DecidedCharacteristic> {
        let standing = |sought: &SoughtCharacteristic| {
            let number =
                |feature| measured_number(feature, sought.quantity, sought.nominal.as_ref());
            let measured = feature.and_then(|(feature, _)| number(feature));
            let of_touches = feature.and_then(|(_, by_touches)| number(by_touches)?.std);
            decided(sought, measured, of_touches, params)
        };
        self.characteristics.iter().map(standing).collect()
    }
}

fn decided(
    sought: &SoughtCharacteristic,
    measured: Option<MeasuredNumber>,
    of_touches: Option<f64>,
    params: &DecisionParams,
) -> DecidedCharacteristic {
    let judged = |number: &MeasuredNumber| {
        assess(
            number,
            sought.limits,
            sought.quantity.distribution(),
            params,
        )
    };
    let (mut shared, mut is_limited) = (0.0, false);
    let assessment = measured.as_ref().map_or_else(Assessment::default, judged);
    if let Some(MeasuredNumber { value, std, .. }) = measured {
        let parts = std.zip(of_touches);
        shared = parts.map_or(0.0, |(std, own)| (std * std - own * own).max(0.0).sqrt());
        let is_open_at = |value: f64| {
            let number = MeasuredNumber::new(value, Some(shared));
            judged(&number).decision == Decision::Undecided
        };
        let stays_open = |own: f64| {
            let moved = |at: i32| value + MOVES * own * f64::from(at) / f64::from(TRIED);
            (-TRIED..=TRIED).all(|at| is_open_at(moved(at)))
                || own <= LEAST_SHARE * shared && is_open_at(value)
        };
        // a number that its touches do not fix stays open
        is_limited = assessment.decision == Decision::Undecided
            && parts.is_none_or(|(_, own)| stays_open(own));
    }
    DecidedCharacteristic {
        sought: sought.clone(),
        measured,
        shared,
        assessment,
        is_limited,
    }
}

impl DecidedCharacteristic {
    /// Whether touches can still decide it.
    pub fn is_open(&self) -> bool {
        self.assessment.decision == Decision::Undecided && !self.is_limited
    }

    /// Standard deviation to reach by touches, m; `None` without a request.
    fn asked(&self, guard: f64) -> Option<f64> {
        let MeasuredNumber { value, std, .. } = self.measured.filter(|_| self.is_open())?;
        let ToleranceLimits { lower, upper } = self.sought.limits;
        let nearest = [lower, upper]
            .into_iter()
            .flatten()
            .map(|limit| (value - limit).abs());
        let wanted = nearest.fold(f64::INFINITY, f64::min) / guard;
        let own = (std?.powi(2) - self.shared.powi(2)).max(0.0).sqrt();
        let asked = (wanted.powi(2) - self.shared.powi(2)).max(0.0).sqrt();
        Some(asked.clamp(LEAST_STEP * own, own.max(f64::MIN_POSITIVE)))
    }
}

/// Requested deviations of a feature's numbers; half the diameter of position is the place itself.
pub(super) fn open_numbers(
    standing: &[DecidedCharacteristic],
    params: &DecisionParams,
) -> OpenNumbers {
    let guard = normal_quantile(params.confidence);
    let mut open = OpenNumbers::default();
    for one in standing {
        let Some(sigma) = one.asked(guard) else {
            continue;
        };
        let (number, sigma) = match one.sought.quantity {
            InspectedQuantity::Position => (&mut open.place, sigma / 2.0),
            InspectedQuantity::X | InspectedQuantity::Y | InspectedQuantity::Z => {
                (&mut open.place, sigma)
            }
            InspectedQuantity::Length => (&mut open.length, sigma),
            _ => (&mut open.size, sigma),
        };
        *number = Some(number.map_or(sigma, |before: f64| before.min(sigma)));
    }
    open
}

#[cfg(test)]
mod tests {
    use super::*;

    const Z: f64 = 1.644_853_626_951_472_2;

    fn diameter(value: f64, own: f64, shared: f64) -> DecidedCharacteristic {
        let limits = ToleranceLimits {
            lower: Some(9.0),
            upper: Some(11.0),
        };
        let (name, quantity) = (String::new(), InspectedQuantity::Diameter);
        let sought = SoughtCharacteristic {
            name,
            quantity,
            limits,
            nominal: None,
        };
        let measured = MeasuredNumber::new(value, Some(own.hypot(shared)));
        decided(
            &sought,
            Some(measured),
            Some(own),
            &DecisionParams::default(),
        )
    }

    /// 0.5 from its limit, with a guard band of 1.645 u: u has to be 0.304, and 0.1 is no touch's.
    #[test]
    fn an_open_number_is_asked_for_as_well_as_its_distance_from_the_limit_needs() {
        let open = diameter(10.5, 0.4, 0.1);
        assert!(
            open.is_open() && (open.shared - 0.1).abs() < 1e-12,
            "{open:?}"
        );
        let asked = open_numbers(&[open], &DecisionParams::default());
        let expected = ((0.5 / Z).powi(2) - 0.01).sqrt();
        assert!(
            (asked.size.unwrap() - expected).abs() < 1e-9,
            "{asked:?} {expected}"
        );
        assert_eq!((asked.place, asked.length), (None, None));
    }

    #[test]
    fn what_is_decided_is_asked_for_no_more() {
        for (value, decision) in [(10.0, Decision::Pass), (11.5, Decision::Fail)] {
            let found = diameter(value, 0.1, 0.1);
            assert_eq!(found.assessment.decision, decision);
            assert_eq!(
                open_numbers(&[found], &DecisionParams::default()),
                OpenNumbers::default()
            );
        }
    }

    /// The shared part alone has a guard band of 0.33, and the value is 0.05 from the limit:
    /// touches that say so within 0.09 leave it open.
    #[test]
    fn what_the_shared_part_leaves_open_is_limited_and_what_touches_may_move_is_not() {
        assert!(diameter(10.95, 0.08, 0.2).is_limited);
        assert!(
            !diameter(10.95, 0.2, 0.2).is_limited,
            "it may turn out to be 10.5"
        );
        assert!(
            !diameter(11.0, 0.2, 0.0).is_limited,
            "nothing is shared, so touches alone decide"
        );
    }

    #[test]
    fn nothing_is_decided_before_the_shape_is_fixed() {
        let limits = ToleranceLimits {
            lower: None,
            upper: Some(1.0),
        };
        let sought = SoughtCharacteristic {
            name: String::new(),
            quantity: InspectedQuantity::Diameter,
            limits,
            nominal: None,
        };
        let goal = DecisionGoal {
            characteristics: vec![sought],
            params: DecisionParams::default(),
        };
        let standing = goal.standing(&goal.params, None);
        assert!(
            standing.iter().all(DecidedCharacteristic::is_open),
            "{standing:?}"
        );
    }
}
