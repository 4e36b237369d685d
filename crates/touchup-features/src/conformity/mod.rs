//! Conformity of measured characteristics with the tolerances of a drawing.
//!
//! If nothing else is known of the measurand, a measured value y with standard uncertainty u
//! implies a distribution about y with the standard deviation u [JCGM 106:2012, 6]. The conformance
//! probability is the share of that distribution between the tolerance limits,
//!
//! p_c = Φ((T_U − y) / u) − Φ((T_L − y) / u)   [JCGM 106:2012, 7.3 and 7.4]
//!
//! and the decision is for acceptance if p_c is large enough ([`assess`]): the tolerance zone
//! without a guard band at either limit [ISO 14253-1:2017]. Numbers of one characteristic share one
//! unit, whichever that is.

mod assess;
mod general;
mod matching;
mod of_feature;
mod place;
mod probability;
mod repeated;

pub use assess::{
    Assessment, Decision, DecisionParams, DecisionRule, MeasuredNumber, OpenReason, assess,
};
pub use general::GeneralTolerance;
pub use matching::{FeatureMatch, FeaturePlace, SoughtFeature, match_features};
pub use of_feature::measured_number;
pub use place::place_number;
pub use probability::{Distribution, ToleranceLimits};
pub use repeated::repeated_confidence;
