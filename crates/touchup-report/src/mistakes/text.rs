//! Mistakes as a chapter of the report.

use super::{CheckedRecording, Mistakes, RightCount};
use crate::{Chapter, Table, TableOf};
use touchup_sim::{INPUT_MISTAKES, InputMistake, SimWorld};

impl Mistakes {
    /// As a part of the report.
    pub fn chapter(&self) -> Chapter {
        let mut text = vec![self.introduction()];
        text.extend(
            self.failed
                .iter()
                .map(|reason| format!("Not run: {reason}.")),
        );
        Chapter::of(
            "Mistakes: what is said of wrong input",
            text,
            vec![],
            vec![self.named(), self.sound(), self.missed()],
        )
    }

    /// Those with a mistake, and those without.
    pub fn counts(&self) -> [RightCount; 2] {
        let (made, sound): (Vec<_>, Vec<_>) = self
            .checked
            .iter()
            .partition(|checked| checked.mistake.is_some());
        [made, sound].map(|checked| RightCount::of(checked.into_iter()))
    }

    fn introduction(&self) -> String {
        let worlds: Vec<&str> = self
            .params
            .worlds
            .iter()
            .map(|world| world.name())
            .collect();
        format!(
            "A plate, scanned and touched in the simulated worlds {}, seeds {} to {} of each, and {} times as many more without a mistake. Each recording is \
             checked as `touchup doctor` does, as it is and with one mistake in it. Named: what is said first has the right cause, and is \
             sure, so that `refine` writes nothing. Of a sound recording nothing may be said at all.",
            worlds.join(", "),
            self.params.seeds.start(),
            self.params.seeds.end(),
            self.params.more_sound,
        )
    }

    fn of(&self, world: SimWorld) -> impl Iterator<Item = &CheckedRecording> {
        self.checked
            .iter()
            .filter(move |checked| checked.world == world)
    }

    fn named(&self) -> Table {
        let kinds: Vec<_> = INPUT_MISTAKES.iter().collect();
        let of_kind = |name: &'static str| {
            move |checked: &&CheckedRecording| {
                checked.mistake.is_some_and(|mistake| mistake.name == name)
            }
        };
        let table = Table::of("mistakes", "Mistakes that are named", kinds.iter().copied())
            .column("mistake", |kind| kind.name)
            .column("cause", |kind| kind.cause.to_string());
        let of_world = |table: TableOf<&'static InputMistake>, &world: &SimWorld| {
            table.column(world.name(), |kind| {
                let RightCount { right, all } =
                    RightCount::of(self.of(world).filter(of_kind(kind.name)));
                format!("{right} of {all}")
            })
        };
        let table = self.params.worlds.iter().fold(table, of_world);
        table
            .column("for example", |kind| {
                let example = self
                    .checked
                    .iter()
                    .filter(of_kind(kind.name))
                    .find(|checked| checked.is_right());
                example.map(CheckedRecording::said)
            })
            .caption("Recordings whose cause is named first and surely, of all with that mistake.")
    }

    fn sound(&self) -> Table {
        Table::of(
            "sound",
            "Recordings without a mistake",
            self.params.worlds.iter().copied(),
        )
        .column("world", SimWorld::name)
        .column("recordings", |world| {
            self.of(world)
                .filter(|checked| checked.mistake.is_none())
                .count()
        })
        .column("alarms", |world| {
            self.of(world)
                .filter(|checked| checked.mistake.is_none() && !checked.is_right())
                .count()
        })
        .caption("Alarms: something is said, be it only that it may be.")
    }

    fn missed(&self) -> Table {
        let missed: Vec<_> = self
            .checked
            .iter()
            .filter(|checked| !checked.is_right())
            .collect();
        Table::of(
            "missed",
            "Recordings that are judged wrongly",
            missed.iter().copied(),
        )
        .column("world", |checked| checked.world.name())
        .column("seed", |checked| checked.seed as usize)
        .column("mistake", |checked| {
            checked.mistake.map_or("none", |mistake| mistake.name)
        })
        .column("said", CheckedRecording::said)
        .caption("What is said first; nothing where that is empty.")
    }
}
