//! The table of characteristics with their decisions.

use super::tolerance_bar::tolerance_bar;
use crate::features::InspectedQuantity;
use crate::html::{escaped, table as html_table};
use crate::inspection::rows::Inspected;
use crate::io::inspection_file::CharacteristicRecord;

/// How a decision looks.
pub(super) struct DecisionLook {
    /// of its field
    pub fill: &'static str,
    /// of its letters
    pub ink: &'static str,
    /// beside its word
    pub sign: &'static str,
}

/// Bluish green, vermillion and yellow: told apart without red or green as well, and each has its
/// sign and its word.
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

/// A decision as a word with its sign.
pub(super) fn chip(decision: &str) -> String {
    let DecisionLook { fill, ink, sign } = look_of(decision);
    let word = decision.to_uppercase();
    format!(
        "<span class=\"chip {decision}\" style=\"background:{fill};color:{ink}\">{sign} {word}</span>"
    )
}

/// A number with the digits that a drawing has; none: a dash.
pub(super) fn shown(number: Option<f64>) -> String {
    number.map_or_else(|| "–".to_owned(), |number| minus(&format!("{number:.3}")))
}

/// With the sign of mathematics.
fn minus(number: &str) -> String {
    number.replace('-', "−")
}

/// A probability in percent, as far as it is not certain.
pub(super) fn probability(share: f64) -> String {
    match share * 100.0 {
        percent if percent > 99.9 => "&gt; 99.9 %".to_owned(),
        percent if percent < 0.1 => "&lt; 0.1 %".to_owned(),
        percent => format!("{percent:.1} %"),
    }
}

/// What a quantity is called in words.
pub(super) fn in_words(quantity: &str) -> String {
    InspectedQuantity::of_name(quantity)
        .map_or(quantity, |quantity| quantity.parts().0)
        .replace('_', " ")
}

pub(super) fn table_row(one: &CharacteristicRecord) -> Vec<String> {
    let number = |name: &str| shown(one.number(name));
    let unit = match one.unit() {
        "deg" => "°",
        unit => unit,
    };
    let limits = match (one.number("lower_limit"), one.number("upper_limit")) {
        (Some(_), Some(_)) => format!("{}<br>{}", number("lower_limit"), number("upper_limit")),
        (Some(_), None) => format!("≥ {}", number("lower_limit")),
        (None, _) => format!("≤ {}", number("upper_limit")),
    };
    let bound = if one.is_at_least { "≥ " } else { "" };
    let actual = one
        .number("actual")
        .map_or("–".to_owned(), |_| format!("{bound}{}", number("actual")));
    let deviation = one
        .number("deviation")
        .map_or("–".to_owned(), |off| minus(&format!("{off:+.3}")));
    let risk = match (&*one.decision, one.conformance_probability) {
        (_, None) => String::new(),
        ("undecided", Some(p)) => {
            format!(
                "risk if accepted {}, if rejected {}",
                probability(1.0 - p),
                probability(p)
            )
        }
        (_, Some(_)) => format!("risk {}", probability(one.risk.unwrap_or_default())),
    };
    let why = one.reason.as_ref().map_or(String::new(), |why| {
        format!("<span class=\"why\">{}</span>", escaped(why))
    });
    let from = if one.tolerance_from == "drawing" {
        String::new()
    } else {
        format!(" · {}", escaped(&one.tolerance_from))
    };
    vec![
        escaped(&one.number),
        format!(
            "{}<br><span class=\"small\">{} {}{from}</span>",
            escaped(&one.name),
            escaped(&one.kind),
            in_words(&one.quantity)
        ),
        format!("{} <span class=\"unit\">{unit}</span>", number("nominal")),
        limits,
        actual,
        deviation,
        number("expanded_uncertainty"),
        tolerance_bar(one),
        format!(
            "{}<span class=\"why\">{risk}</span>{why}",
            chip(&one.decision)
        ),
    ]
}

/// The section.
pub(super) fn table(inspected: &Inspected) -> String {
    let record = &inspected.record;
    let uncertainty = format!("U<br>(k = {})", record.coverage_factor);
    let head = [
        "No.",
        "Characteristic",
        "Nominal",
        "Limits",
        "Actual",
        "Deviation",
        &uncertainty,
        "In the tolerance",
        "Decision and risk",
    ];
    let rows: Vec<_> = record.characteristics.iter().map(table_row).collect();
    let key = "<p class=\"small\">Lengths in mm, angles in degrees. The number before the point is that of the balloon in the picture. Bar: grey is the tolerance zone \
               between its limits, green the acceptance zone that the guard bands leave, dot and line the measured value with ± U; ◀ ▶ beyond the drawing. ≥: a lower \
               bound, the end was not touched. Risk: the probability that the decision is wrong.</p>\n";
    format!(
        "<h2>Characteristics</h2>\n<div class=\"scroll\">{}</div>\n{key}",
        html_table("num", &head, &rows)
    )
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::colour_vision::least_difference;
    use crate::conformity::Decision;

    /// 10 is a difference that nobody overlooks side by side.
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
            ["&gt; 99.9 %", "50.0 %", "&lt; 0.1 %"]
        );
    }
}
