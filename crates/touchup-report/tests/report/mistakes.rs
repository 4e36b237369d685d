//! Mistakes: the counts against cases worked by hand, and a run from end to end.

use touchup_features::diagnose::{InputCause, InputFinding};
use touchup_report::Effort;
use touchup_report::mistakes::{CheckedRecording, MistakesParams, RightCount, mistakes};
use touchup_sim::{INPUT_MISTAKES, InputMistake, SimWorld};

use crate::markdown;

fn finding(cause: InputCause, is_sure: bool) -> InputFinding {
    InputFinding {
        cause,
        is_sure,
        measured: "measured".to_owned(),
        numbers: Vec::new(),
        remedy: "do",
        correction: None,
    }
}

fn checked(
    mistake: Option<&'static InputMistake>,
    findings: Vec<InputFinding>,
) -> CheckedRecording {
    CheckedRecording {
        world: SimWorld::Ur,
        seed: 1,
        mistake,
        findings,
    }
}

#[test]
fn a_mistake_is_named_by_its_cause_alone_and_surely() {
    let reversed = INPUT_MISTAKES
        .iter()
        .find(|mistake| mistake.cause == InputCause::WrenchSign);
    assert!(reversed.is_some());
    let sign = |is_sure| finding(InputCause::WrenchSign, is_sure);
    let of = |findings| checked(reversed, findings);
    let all = [
        of(vec![sign(true)]),
        of(vec![sign(true), finding(InputCause::Tare, true)]),
        of(vec![finding(InputCause::Tare, true), sign(true)]),
        of(vec![sign(false)]),
        of(vec![]),
        checked(None, vec![]),
        checked(None, vec![finding(InputCause::Delay, false)]),
    ];
    assert_eq!(
        all.each_ref().map(CheckedRecording::is_right),
        [true, true, false, false, false, true, false]
    );
    assert_eq!(RightCount::of(all.iter()), RightCount { right: 3, all: 7 });
    assert_eq!(all[3].said(), "wrench_sign: perhaps: measured; do");
    assert_eq!(all[4].said(), "");
}

#[test]
#[ignore = "a slow proof"]
fn mistakes_are_named_and_sound_recordings_raise_no_alarm() {
    // the chapter itself has five seeds
    let params = MistakesParams {
        seeds: 1..=2,
        ..MistakesParams::of(Effort { is_quick: false })
    };
    let found = mistakes(params.clone(), &mut |_| {});
    assert_eq!(found.failed, Vec::<String>::new());
    let [made, sound] = found.counts();
    let seeds = params.seeds.clone().count();
    assert_eq!(made.all, params.worlds.len() * seeds * INPUT_MISTAKES.len());
    assert_eq!(
        sound.all,
        params.worlds.len() * seeds * (1 + params.more_sound as usize)
    );
    let chapter = found.chapter();
    let [named, worlds, missed] = chapter.tables.as_slice() else {
        panic!("three tables")
    };
    assert_eq!(
        (named.rows.len(), worlds.rows.len()),
        (INPUT_MISTAKES.len(), params.worlds.len())
    );
    assert_eq!(
        missed.rows.len(),
        made.all - made.right + sound.all - sound.right
    );
    assert!(
        made.right as f64 >= 0.95 * made.all as f64 && sound.right == sound.all,
        "{:?}",
        missed.rows
    );
    println!("{}", chapter.text[0]);
    for table in &chapter.tables {
        println!("\n{}", markdown(table, 0));
    }
}
