//! The program of ur-rtde on the controller, extended by a count of its cycles.
//!
//! Its main loop reads the command registers once in each cycle of the controller. When that loop
//! hangs, its threads live on, and with them the last motion; the client writes its registers as
//! before, and misses no answer. So the loop counts its cycles in an output register, which comes
//! with each state.

use super::error::ChildError;

/// The output register of the count.
pub const REGISTER: u8 = 19;
/// Lines at the start of a cycle, and of a command longer than a cycle; each once in the program.
const CYCLE: &str = "        while keep_running:\n";
const COMMAND: &str = "                    if not executing_cmd:\n";

/// The program of the library with its count, ready for upload.
///
/// # Errors
/// [`ChildError::Python`] for an unknown version of the program.
pub fn counting(library: &str) -> Result<String, ChildError> {
    if [CYCLE, COMMAND]
        .iter()
        .any(|place| library.matches(place).count() != 1)
    {
        return Err(ChildError::Python {
            call: "getScript",
            reason: "the program of ur-rtde has another main loop than this was made for"
                .to_owned(),
        });
    }
    // the count restarts before its numbers become too large
    let cycle = format!(
        "        cycle = 0
{CYCLE}            cycle = cycle + 1
            if cycle > 1000000:
                cycle = 1
            end
            write_output_integer_register({REGISTER}, cycle)
"
    );
    let command =
        format!("{COMMAND}                        write_output_integer_register({REGISTER}, -1)\n");
    let counted = library.replace(CYCLE, &cycle).replace(COMMAND, &command);
    Ok(format!("def rtde_control():\n{counted}end\n"))
}

/// A program with both lines and nothing else of the library's.
#[cfg(test)]
pub const PLACES: &str = "        before_the_loop()
        while keep_running:
                    if not executing_cmd:
                        take_the_command()
                    end
            sync()
        end
";

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn each_cycle_is_counted_before_its_command_is_read_and_a_long_command_says_so_first() {
        let program = counting(PLACES).unwrap();
        let lines: Vec<_> = program.lines().map(str::trim).collect();
        let at = |line: &str| lines.iter().position(|other| *other == line).unwrap();
        let order = [
            "def rtde_control():",
            "before_the_loop()",
            "cycle = 0",
            "while keep_running:",
            "cycle = cycle + 1",
            "write_output_integer_register(19, cycle)",
            "write_output_integer_register(19, -1)",
            "take_the_command()",
            "sync()",
        ];
        assert!(order.map(at).is_sorted(), "{program}");
        assert_eq!(lines.last(), Some(&"end"));
        // the library's program is complete
        assert!(PLACES.lines().all(|line| program.contains(line)));
        for other in ["", &PLACES.repeat(2)] {
            assert!(counting(other).is_err());
        }
    }
}
