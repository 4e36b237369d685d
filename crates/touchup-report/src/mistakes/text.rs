//! Mistakes as a chapter of the report.

use super::{CheckedRecording, Mistakes, RightCount};
use crate::table::not_run;
use crate::{Chapter, Table, TableOf};
use itertools::Itertools;
use touchup_sim::{INPUT_MISTAKES, InputMistake, SimWorld};

impl Mistakes {
    /// Chapter of the report.
    pub fn chapter(&self) -> Chapter {
        let text = std::iter::once(self.introduction()).chain(not_run(&self.failed));
        let tables = vec![self.named(), self.sound(), self.missed()];
        Chapter::of(
            "Mistakes: what is said of wrong input",
            text.collect(),
            vec![],
            tables,
        )
    }

    /// Counts for recordings with a mistake, and without.
    pub fn counts(&self) -> [RightCount; 2] {
        let checked = self.checked.iter();
        let (made, sound): (Vec<_>, Vec<_>) =
            checked.partition(|checked| checked.mistake.is_some());
        [made, sound].map(|checked| RightCount::of(checked.into_iter()))
    }

    fn introduction(&self) -> String {
        format!(
            "A plate, scanned and touched in the simulated worlds {}, seeds {} to {} of each, and {} times as many more without a mistake. Each recording is \
             checked as `touchup doctor` does, as it is and with one mistake in it. Named: what is said first has the right cause, and is \
             sure, so that `refine` writes nothing. Of a sound recording nothing may be said at all.",
            self.params
                .worlds
                .iter()
                .map(|world| world.name())
                .join(", "),
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
        let has = |name| {
            move |checked: &&CheckedRecording| {
                checked.mistake.is_some_and(|mistake| mistake.name == name)
            }
        };
        let table = Table::of("mistakes", "Mistakes that are named", INPUT_MISTAKES)
            .column("mistake", |kind| kind.name)
            .column("cause", |kind| kind.cause.to_string());
        let of_world = |table: TableOf<&'static InputMistake>, &world: &SimWorld| {
            table.column(world.name(), |kind| {
                let RightCount { right, all } =
                    RightCount::of(self.of(world).filter(has(kind.name)));
                format!("{right} of {all}")
            })
        };
        let table = self.params.worlds.iter().fold(table, of_world);
        table
            .column("for example", |kind| {
                let mut of_kind = self.checked.iter().filter(has(kind.name));
                of_kind
                    .find(|checked| checked.is_right())
                    .map(CheckedRecording::said)
            })
            .caption("Recordings whose cause is named first and surely, of all with that mistake.")
    }

    fn sound(&self) -> Table {
        let sound = |world| self.of(world).filter(|checked| checked.mistake.is_none());
        let worlds = self.params.worlds.iter().copied();
        Table::of("sound", "Recordings without a mistake", worlds)
            .column("world", SimWorld::name)
            .column("recordings", |world| sound(world).count())
            .column("alarms", |world| {
                sound(world).filter(|checked| !checked.is_right()).count()
            })
            .caption("Alarms: something is said, be it only that it may be.")
    }

    fn missed(&self) -> Table {
        let missed = self.checked.iter().filter(|checked| !checked.is_right());
        Table::of("missed", "Recordings that are judged wrongly", missed)
            .column("world", |checked| checked.world.name())
            .column("seed", |checked| checked.seed as usize)
            .column("mistake", |checked| {
                checked.mistake.map_or("none", |mistake| mistake.name)
            })
            .column("said", CheckedRecording::said)
            .caption("What is said first; nothing where that is empty.")
    }
}
