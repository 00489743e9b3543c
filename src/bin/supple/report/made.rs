//! How a part of a report was made: the command that repeats it, the version, the machine, what random numbers begin
//! with.

use std::path::Path;
use std::time::{SystemTime, UNIX_EPOCH};

use serde::{Deserialize, Serialize};
use supple::simd::Level;

#[derive(Deserialize, Serialize)]
pub struct Made {
    command: String,
    version: String,
    machine: String,
    seeds: String,
    /// Since 1970.
    pub seconds: u64,
}

impl Made {
    /// Now, by this program with its arguments; `seeds` in words.
    pub fn now(words: &[String], seeds: &str) -> Self {
        let seconds = SystemTime::now().duration_since(UNIX_EPOCH).map_or(0, |since| since.as_secs());
        let command = words.iter().map(|word| quoted(word)).collect::<Vec<_>>().join(" ");
        Self {
            command,
            version: format!("supple {}", env!("CARGO_PKG_VERSION")),
            machine: machine(),
            seeds: seeds.into(),
            seconds,
        }
    }

    /// By the command as it was started.
    pub fn by_this_command(seeds: &str) -> Self {
        let mut words: Vec<_> = std::env::args_os().map(|word| word.to_string_lossy().into_owned()).collect();
        // However it was found.
        if let Some(program) = words.first_mut() {
            *program = Path::new(program).file_stem().unwrap_or_default().to_string_lossy().into_owned();
        }
        Self::now(&words, seeds)
    }

    /// What to tell, by name.
    pub fn lines(&self) -> [(&'static str, &str); 4] {
        [
            ("repeat with", &self.command),
            ("version", &self.version),
            ("machine", &self.machine),
            ("random numbers", &self.seeds),
        ]
    }
}

/// A word as a shell takes it.
fn quoted(word: &str) -> String {
    let plain = |letter: char| letter.is_ascii_alphanumeric() || "-_./=,:+".contains(letter);
    if !word.is_empty() && word.chars().all(plain) {
        return word.into();
    }
    format!("'{}'", word.replace('\'', r"'\''"))
}

fn machine() -> String {
    let cores = std::thread::available_parallelism().map_or(1, usize::from);
    let model = std::fs::read_to_string("/proc/cpuinfo").ok().and_then(|text| {
        let line = text.lines().find(|line| line.starts_with("model name"))?;
        line.split_once(':').map(|(_, model)| model.trim().to_owned())
    });
    let model = model.unwrap_or_else(|| "processor of an unknown name".into());
    format!(
        "{model}, {cores} cores, {}, {} ({:?} instructions)",
        std::env::consts::OS,
        std::env::consts::ARCH,
        Level::current()
    )
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_command_can_be_pasted_into_a_shell() {
        let words = ["supple", "simulate", "my scene.toml", "--out", "it's", ""].map(String::from);
        let made = Made::now(&words, "none");
        assert_eq!(made.lines()[0].1, r"supple simulate 'my scene.toml' --out 'it'\''s' ''");
    }
}
