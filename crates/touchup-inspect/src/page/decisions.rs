//! The table of characteristics with their decisions.

use maud::{Markup, html};
use touchup_document::number::{fixed, signed};

use super::tolerance_bar::tolerance_bar;
use crate::rows::Inspection;
use touchup_features::features::InspectedQuantity;
use touchup_io::inspection_file::CharacteristicRecord;

/// Look of a decision.
pub(super) struct DecisionLook {
    /// colour of the field
    pub fill: &'static str,
    /// colour of the letters
    pub ink: &'static str,
    /// sign beside the word
    pub sign: &'static str,
}

/// Bluish green, vermillion and yellow: distinct without red or green vision too, each with its
/// sign and word.
pub(super) fn look_of(decision: &str) -> DecisionLook {
    match decision {
        "pass" => DecisionLook {
            fill: "#00735a",
            ink: "#ffffff",
            sign: "✓",
        },
        "fail" => DecisionLook {
            fill: "#b94a00",
            ink: "#ffffff",
            sign: "✗",
        },
        _ => DecisionLook {
            fill: "#f3e26b",
            ink: "#1d2129",
            sign: "?",
        },
    }
}

/// A number with a drawing's digits; a dash for none.
pub(super) fn shown(number: Option<f64>) -> String {
    number.map_or_else(|| "–".to_owned(), |number| fixed(number, 3))
}

/// A probability in percent, bounded near certainty.
pub(super) fn probability(share: f64) -> String {
    match share * 100.0 {
        percent if percent > 99.9 => "> 99.9 %".to_owned(),
        percent if percent < 0.1 => "< 0.1 %".to_owned(),
        percent => format!("{percent:.1} %"),
    }
}

/// The name of a quantity in words.
pub(super) fn in_words(quantity: &str) -> String {
    InspectedQuantity::of_name(quantity)
        .map_or(quantity, |quantity| quantity.parts().0)
        .replace('_', " ")
}

fn row(one: &CharacteristicRecord) -> Markup {
    let number = |name: &str| shown(one.number(name));
    let unit = match one.unit() {
        "deg" => "°",
        unit => unit,
    };
    let (lower, upper) = (number("lower_limit"), number("upper_limit"));
    let has = |name: &str| one.number(name).is_some();
    let risk = match (&*one.decision, one.conformance_probability) {
        (_, None) => String::new(),
        ("undecided", Some(p)) => {
            let [accepted, rejected] = [1.0 - p, p].map(probability);
            format!("risk if accepted {accepted}, if rejected {rejected}")
        }
        (_, Some(_)) => format!("risk {}", probability(one.risk.unwrap_or_default())),
    };
    let DecisionLook { fill, ink, sign } = look_of(&one.decision);
    html! {
        td { (one.number) }
        td {
            (one.name) br;
            span.small {
                (one.kind) " " (in_words(&one.quantity))
                @if one.tolerance_from != "drawing" { " · " (one.tolerance_from) }
            }
        }
        td { (number("nominal")) " " span.unit { (unit) } }
        td {
            @if !has("lower_limit") { "≤ " (upper) }
            @else if has("upper_limit") { (lower) br; (upper) }
            @else { "≥ " (lower) }
        }
        td { @if has("actual") && one.is_at_least { "≥ " } (number("actual")) }
        td { (one.number("deviation").map_or("–".to_owned(), |off| signed(off, 3))) }
        td { (number("expanded_uncertainty")) }
        td { (tolerance_bar(one)) }
        td {
            span class={ "chip " (one.decision) } style={ "background:" (fill) ";color:" (ink) } {
                (sign) " " (one.decision.to_uppercase())
            }
            span.why { (risk) }
            @if let Some(why) = &one.reason { span.why { (why) } }
        }
    }
}

/// The section.
pub(super) fn table(inspected: &Inspection) -> Markup {
    let record = &inspected.record;
    html! {
        h2 { "Characteristics" }
        div.scroll {
            table.num {
                thead {
                    tr {
                        @for head in ["No.", "Characteristic", "Nominal", "Limits", "Actual", "Deviation"] {
                            th scope="col" { (head) }
                        }
                        th scope="col" { "U" br; "(k = " (record.coverage_factor) ")" }
                        th scope="col" { "In the tolerance" }
                        th scope="col" { "Decision and risk" }
                    }
                }
                tbody { @for one in &record.characteristics { tr { (row(one)) } } }
            }
        }
        p.small {
            "Lengths in mm, angles in degrees. The number before the point is that of the balloon in the picture. Bar:             grey is the tolerance zone between its limits, green the acceptance zone that the guard bands leave, dot             and line the measured value with ± U; ◀ ▶ beyond the drawing. ≥: a lower bound, the end was not touched.             Risk: the probability that the decision is wrong."
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::colour_vision::least_difference;
    use touchup_features::conformity::Decision;

    /// A difference of 10 is evident side by side.
    #[test]
    fn decisions_are_told_apart_by_who_lacks_a_cone() {
        let byte = |hex: &str, at: usize| u8::from_str_radix(&hex[at..at + 2], 16).unwrap();
        let colours = Decision::ALL
            .map(|decision| look_of(decision.name()).fill)
            .map(|hex| [byte(hex, 1), byte(hex, 3), byte(hex, 5)]);
        assert!(
            least_difference(&colours) > 10.0,
            "{}",
            least_difference(&colours)
        );
    }

    #[test]
    fn a_probability_is_never_rounded_to_certainty() {
        assert_eq!(
            [0.9999, 0.5, 1e-9].map(probability),
            ["> 99.9 %", "50.0 %", "< 0.1 %"]
        );
    }
}
