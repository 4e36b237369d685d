//! `touchup step`: the paper's equations for one held sample per JSON line, for comparison with any
//! other implementation.
//!
//! In:
//! `{"p_m","force_n","b_m","n","dt_s","h_min_m","delta","f_max_n","alpha_m_per_n_s","beta_per_n2_s",
//! "step":"lie|corrected|bounded|dp5","along":"normal0|force"}`, vectors as arrays of three, all in
//! one frame; `k_n_per_m` instead of the three sigmoid values selects the linear spring. Out, in
//! the same order: `{"b_m","n"}` with 17 digits, or `{"error"}`; a bad line does not end the run.
//! The dynamics keep the rigid-contact offset.

use std::io::{self, BufRead, Write};

use nalgebra::{Point3, Vector3};
use serde::Deserialize;

use touchup_method::haptic::{
    ContactModel, DynamicsError, DynamicsParams, FaceDynamics, FaceState, MotionDirection,
    SigmoidParams, StepRule,
};

/// Longest line of a sample, bytes.
const LONGEST_LINE: u64 = 64 * 1024;

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct StepQuestion {
    p_m: [f64; 3],
    force_n: [f64; 3],
    b_m: [f64; 3],
    n: [f64; 3],
    dt_s: f64,
    h_min_m: Option<f64>,
    delta: Option<f64>,
    f_max_n: Option<f64>,
    k_n_per_m: Option<f64>,
    alpha_m_per_n_s: f64,
    beta_per_n2_s: f64,
    step: StepRule,
    along: MotionDirection,
}

#[derive(Debug, thiserror::Error)]
enum StepError {
    #[error("{0}")]
    Json(#[from] serde_json::Error),
    #[error("missing field `{0}` (or give `k_n_per_m` for the linear spring)")]
    Missing(&'static str),
    #[error(
        "`{0}` and `k_n_per_m` exclude each other: one is of the sigmoid, the other of the linear spring"
    )]
    TwoModels(&'static str),
    #[error("the line is longer than {LONGEST_LINE} bytes")]
    TooLong,
    #[error(transparent)]
    Dynamics(#[from] DynamicsError),
}

/// Answers every line of `input` with one line on `output`, flushed at once; skips blank lines.
///
/// # Errors
/// Failures of reading or writing; an unanswerable line gets `{"error": …}`.
pub fn run(mut input: impl BufRead, mut output: impl Write) -> io::Result<()> {
    let mut line = Vec::new();
    loop {
        line.clear();
        let length = io::Read::take(&mut input, LONGEST_LINE).read_until(b'\n', &mut line)?;
        if length == 0 {
            return Ok(());
        }
        let reply = if length as u64 == LONGEST_LINE && line.last() != Some(&b'\n') {
            input.skip_until(b'\n')?;
            Err(StepError::TooLong)
        } else if line.trim_ascii().is_empty() {
            continue;
        } else {
            answer(&line)
        };
        match reply {
            Ok(FaceState { b, n }) => writeln!(
                output,
                "{{\"b_m\":{},\"n\":{}}}",
                array(&b.coords),
                array(&n)
            )?,
            Err(error) => writeln!(
                output,
                "{}",
                serde_json::json!({ "error": error.to_string() })
            )?,
        }
        output.flush()?;
    }
}

fn answer(line: &[u8]) -> Result<FaceState, StepError> {
    let question: StepQuestion = serde_json::from_slice(line)?;
    let dynamics = FaceDynamics::new(DynamicsParams {
        model: model_of(&question)?,
        alpha_m_per_n_s: question.alpha_m_per_n_s,
        beta_per_n2_s: question.beta_per_n2_s,
        rule: question.step,
        along: question.along,
        take_out_rigid_offset: false,
    })?;
    let face = FaceState {
        b: Point3::from(question.b_m),
        n: Vector3::from(question.n),
    };
    Ok(dynamics.step(
        &face,
        &Point3::from(question.p_m),
        &Vector3::from(question.force_n),
        question.dt_s,
    )?)
}

fn model_of(question: &StepQuestion) -> Result<ContactModel, StepError> {
    let sigmoid = [
        ("h_min_m", question.h_min_m),
        ("delta", question.delta),
        ("f_max_n", question.f_max_n),
    ];
    if let Some(stiffness_n_per_m) = question.k_n_per_m {
        return match sigmoid.iter().find(|(_, value)| value.is_some()) {
            Some((name, _)) => Err(StepError::TwoModels(name)),
            None => Ok(ContactModel::Spring { stiffness_n_per_m }),
        };
    }
    let [h_min_m, delta, f_max_n] =
        sigmoid.map(|(name, value)| value.ok_or(StepError::Missing(name)));
    Ok(ContactModel::Sigmoid(SigmoidParams {
        f_max: f_max_n?,
        h_min: h_min_m?,
        delta: delta?,
    }))
}

/// 17 significant digits name a double uniquely.
fn array(v: &Vector3<f64>) -> String {
    format!("[{:.16e},{:.16e},{:.16e}]", v.x, v.y, v.z)
}

#[cfg(test)]
mod tests {
    use super::*;

    const SPRING: &str = r#"{"p_m":[0,0,1e-3],"force_n":[0,0,0],"b_m":[0,0,0],"n":[0,0,1],"dt_s":1,"k_n_per_m":1e3,
        "alpha_m_per_n_s":1,"beta_per_n2_s":0,"step":"lie","along":"force"}"#;

    fn replies(input: &str) -> Vec<String> {
        let mut output = Vec::new();
        run(input.as_bytes(), &mut output).unwrap();
        String::from_utf8(output)
            .unwrap()
            .lines()
            .map(String::from)
            .collect()
    }

    #[test]
    fn every_line_gets_one_reply() {
        // e^−1000 of the distance remains: b lies at the tip; an unended last line counts
        let good = SPRING.replace('\n', "");
        let replies = replies(&format!(
            "{good}\n\n{{}}\n{}\n{good}",
            good.replace("dt_s", "dt_ms")
        ));
        let at_tip = r#"{"b_m":[0.0000000000000000e0,0.0000000000000000e0,1.0000000000000000e-3],"n":[0.0000000000000000e0,0.0000000000000000e0,1.0000000000000000e0]}"#;
        assert_eq!(
            (replies.len(), &*replies[0], &*replies[3]),
            (4, at_tip, at_tip)
        );
        assert!(
            replies[1].contains("missing field `p_m`")
                && replies[2].contains("unknown field `dt_ms`")
        );
    }
}
