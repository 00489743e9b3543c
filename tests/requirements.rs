//! Every requirement of `tests/REQUIREMENTS.md` names tests that exist and that are run, or says why it has none.
//! Prints how many there are of each.

use std::collections::HashSet;
use std::path::Path;

/// Gives the text of a file of the repository, if there is one of this path.
type Read<'a> = &'a dyn Fn(&str) -> Option<String>;

#[derive(Debug, Default, PartialEq)]
struct Counts {
    requirements: usize,
    /// Tests that are named, each once.
    tests: usize,
    /// Identifiers of the requirements without a test, with the reasons.
    open: Vec<String>,
}

/// Counts what the tables of a page hold. Every table of the page is one of requirements; an error is a line for each
/// fault.
fn check(page: &str, read: Read<'_>) -> Result<Counts, Vec<String>> {
    let (mut counts, mut faults) = (Counts::default(), Vec::new());
    let (mut identifiers, mut tests) = (HashSet::new(), HashSet::new());
    // Rows of the current table so far, with its head and the line below.
    let mut row = 0;
    for (index, line) in page.lines().enumerate() {
        row = if line.trim_start().starts_with('|') { row + 1 } else { 0 };
        let mut fault = |what: String| faults.push(format!("line {}: {what}", index + 1));
        match row {
            0 => {}
            1 if line == "| id | requirement | tests |" => {}
            2 if line == "|---|---|---|" => {}
            1 | 2 => fault(format!("not the head of a table of requirements: {line}")),
            _ => {
                let cells: Vec<_> = line.split('|').map(str::trim).collect();
                let ["", id, requirement, named, ""] = cells[..] else {
                    fault(format!("not a row of three cells: {line}"));
                    continue;
                };
                counts.requirements += 1;
                if !is_identifier(id) {
                    fault(format!("not an identifier such as STEP-1: \"{id}\""));
                }
                if !identifiers.insert(id) {
                    fault(format!("the identifier {id} is used twice"));
                }
                if requirement.is_empty() {
                    fault(format!("{id} says nothing"));
                }
                if let Some(reason) = named.strip_prefix("open:") {
                    if reason.trim().is_empty() {
                        fault(format!("{id} is open without a reason"));
                    }
                    counts.open.push(format!("{id}: {}", reason.trim()));
                } else if named.is_empty() {
                    fault(format!("{id} has no test"));
                } else {
                    for test in named.split(',').map(str::trim) {
                        let quoted = test.strip_prefix('`').and_then(|test| test.strip_suffix('`'));
                        match quoted.ok_or("it is not between backticks".into()).and_then(|test| exists(test, read)) {
                            Ok(()) => _ = tests.insert(test),
                            Err(why) => fault(format!("{id} names {test}: {why}")),
                        }
                    }
                }
            }
        }
    }
    if counts.requirements == 0 && faults.is_empty() {
        faults.push("there are no requirements".into());
    }
    counts.tests = tests.len();
    if faults.is_empty() { Ok(counts) } else { Err(faults) }
}

/// Capital letters, a hyphen, a number.
fn is_identifier(id: &str) -> bool {
    id.split_once('-').is_some_and(|(group, number)| {
        !group.is_empty()
            && group.bytes().all(|letter| letter.is_ascii_uppercase())
            && number.bytes().all(|digit| digit.is_ascii_digit())
            && number.parse::<u32>().is_ok_and(|number| number > 0)
    })
}

/// Whether a test, `FILE` or `FILE::FUNCTION`, is there and is run; the error says what is missing.
fn exists(test: &str, read: Read<'_>) -> Result<(), String> {
    let (file, function) = test.split_once("::").map_or((test, None), |(file, name)| (file, Some(name)));
    let text = read(file).ok_or("there is no such file")?;
    // Whether another file has a line with this text: the one that runs the test.
    let named_by = |other: &str, name: &str| {
        let lines = read(other).unwrap_or_default();
        // An attribute of Rust is no comment.
        let is_comment = |line: &str| line.starts_with('/') || (line.starts_with('#') && !line.starts_with("#["));
        if lines.lines().any(|line| !is_comment(line.trim_start()) && line.contains(name)) {
            Ok(())
        } else {
            Err(format!("{other} does not run it"))
        }
    };
    if file.ends_with(".rs") {
        is_test(&text, function.ok_or("it names no function")?)?;
        if let Some(crate_and_module) = file.strip_prefix("tests/") {
            is_compiled(crate_and_module, &named_by)?;
        }
        return Ok(());
    }
    if let Some(program) = file.strip_prefix("tests/capi/").and_then(|file| file.strip_suffix(".c")) {
        if let Some(name) = function {
            let (head, call) = (format!("static void {name}("), format!("    {name}("));
            if !text.lines().any(|line| line.starts_with(&head)) || !text.lines().any(|line| line.starts_with(&call)) {
                return Err("there is no such function, or it is not called".into());
            }
        }
        // Either in a list of programs or with its whole path.
        return named_by("tests/capi/run.sh", &format!("{file} "))
            .or_else(|_| named_by("tests/capi/run.sh", &format!(" {program} ")));
    }
    if file.ends_with(".cpp") {
        return named_by("tests/capi/run.sh", &format!("{file} "));
    }
    if file.ends_with(".sh") && function.is_none() {
        return named_by(".ci/run", file);
    }
    Err("it is neither a Rust test, a program of the C API, nor a script".into())
}

/// Whether a source has a test function of this name, which is not ignored.
fn is_test(source: &str, name: &str) -> Result<(), String> {
    let head = format!("fn {name}(");
    let (mut test, mut ignored) = (false, false);
    for line in source.lines().map(str::trim_start) {
        if line.starts_with(&head) {
            return match (test, ignored) {
                (true, false) => Ok(()),
                (true, true) => Err("the test is ignored".into()),
                _ => Err("the function is no test".into()),
            };
        } else if line.starts_with("#[") {
            test |= line.starts_with("#[test]");
            ignored |= line.starts_with("#[ignore");
        } else if !line.starts_with("//") {
            (test, ignored) = (false, false);
        }
    }
    Err("there is no such function".into())
}

/// Whether a file of `tests/` belongs to a test crate of a package: `CRATE.rs`, `CRATE/MODULE.rs`, or `PART/MODULE.rs`
/// with the parts of tests/kernel.rs; those of the laboratory belong to the tests of its library.
fn is_compiled(file: &str, named_by: &dyn Fn(&str, &str) -> Result<(), String>) -> Result<(), String> {
    let stem = file.strip_suffix(".rs").unwrap_or(file);
    let (name, module) = stem.split_once('/').unwrap_or((stem, "main"));
    let is_part = named_by("tests/kernel.rs", &format!("mod {name};")).is_ok();
    let (root, top) = if is_part { ("mod", "kernel") } else { ("main", name) };
    if module != root && module != "main" {
        named_by(&format!("tests/{name}/{root}.rs"), &format!("mod {module};"))?;
    }
    let (folder, name) = (name, format!("name = \"{top}\""));
    named_by("src/lab/lib.rs", &format!("#[path = \"../../tests/{folder}/main.rs\"]"))
        .or_else(|_| named_by("Cargo.toml", &name))
        .or_else(|_| named_by("src/bin/supple/Cargo.toml", &name))
        .or_else(|_| named_by("src/lab/Cargo.toml", &name))
}

#[test]
fn every_requirement_has_a_test_or_says_why_not() {
    let read = |file: &str| std::fs::read_to_string(Path::new(env!("CARGO_MANIFEST_DIR")).join(file)).ok();
    let page = read("tests/REQUIREMENTS.md").expect("tests/REQUIREMENTS.md");
    match check(&page, &read) {
        Ok(Counts { requirements, tests, open }) => {
            println!("{requirements} requirements, {tests} tests named, {} without a test", open.len());
            open.iter().for_each(|reason| println!("open: {reason}"));
        }
        Err(faults) => panic!("tests/REQUIREMENTS.md:\n{}", faults.join("\n")),
    }
}

/// A repository of few files.
fn small(file: &str) -> Option<String> {
    let text = match file {
        "Cargo.toml" => "[[test]]\nname = \"kernel\"\n#name = \"later\"\n",
        "tests/kernel.rs" => "mod physics;\n",
        "tests/physics/mod.rs" => "mod bars;\n// mod old;\n",
        "tests/physics/bars.rs" => {
            "#[test]\n/// In words.\n#[cfg(any())]\nfn bends() {\n}\n#[test]\n#[ignore]\nfn breaks() {\n}\nfn helps() {\n}\n// fn gone() {\n"
        }
        "tests/physics/old.rs" | "tests/later.rs" | "src/sums.rs" => "    #[test]\n    fn adds() {\n",
        "tests/capi/heap.c" => "static void steps(void) {\nstatic void idle(void) {\n    steps();\n",
        "tests/capi/run.sh" => "for test in sizes heap threads; do\n# stack \n",
        "tests/capi/stack.c" => "",
        ".ci/run" => "    check cross -- tools/cross.sh\n",
        "tools/cross.sh" | "tools/sizes.sh" | "README.md" => "",
        _ => return None,
    };
    Some(text.into())
}

fn page(rows: &str) -> String {
    format!("# Requirements\n\n| id | requirement | tests |\n|---|---|---|\n{rows}\n")
}

#[test]
fn a_sound_table_is_counted() {
    let rows = "| STEP-1 | it bends | `tests/physics/bars.rs::bends`, `src/sums.rs::adds` |\n\
                | STEP-2 | it bends again | `tests/physics/bars.rs::bends`, `tests/capi/heap.c` |\n\
                | HOST-1 | it is small | `tools/cross.sh`, `tests/capi/heap.c::steps` |\n\
                | HOST-2 | it is fast | open: nobody measures it |";
    let open = vec!["HOST-2: nobody measures it".to_string()];
    assert_eq!(check(&page(rows), &small), Ok(Counts { requirements: 4, tests: 5, open }));
}

#[test]
fn every_fault_of_a_table_is_told_with_its_line() {
    let sound = "| A-1 | it bends | `tests/physics/bars.rs::bends` |";
    let names = |test: &str| format!("| A-1 | it bends | {test} |");
    let cases = [
        (page(""), "there are no requirements"),
        (page("| A-1 | it bends |  |"), "line 5: A-1 has no test"),
        (page("| A-1 |  | `src/sums.rs::adds` |"), "line 5: A-1 says nothing"),
        (page("| A-1 | it bends | open: |"), "line 5: A-1 is open without a reason"),
        (page(&format!("{sound}\n{sound}")), "line 6: the identifier A-1 is used twice"),
        (page("| A-1 | it bends |"), "line 5: not a row of three cells"),
        (page("| A-1 | it bends | `src/sums.rs::adds` | more |"), "line 5: not a row of three cells"),
        (page("| A-1 | it bends | `src/sums.rs::adds`"), "line 5: not a row of three cells"),
        (page(" | A1 | it bends | `src/sums.rs::adds` |"), "line 5: not an identifier such as STEP-1: \"A1\""),
        (page("| a-1 | it bends | `src/sums.rs::adds` |"), "not an identifier"),
        (page("| A-+1 | it bends | `src/sums.rs::adds` |"), "not an identifier"),
        (sound.into(), "line 1: not the head of a table of requirements"),
        (page(&names("src/sums.rs::adds")), "it is not between backticks"),
        (page(&names("`src/sums.rs::adds`,")), "it is not between backticks"),
        (page(&names("`src/none.rs::adds`")), "there is no such file"),
        (page(&names("`src/sums.rs`")), "it names no function"),
        (page(&names("`src/sums.rs::add`")), "there is no such function"),
        (page(&names("`tests/physics/bars.rs::gone`")), "there is no such function"),
        (page(&names("`tests/physics/bars.rs::helps`")), "the function is no test"),
        (page(&names("`tests/physics/bars.rs::breaks`")), "the test is ignored"),
        (page(&names("`tests/physics/old.rs::adds`")), "tests/physics/mod.rs does not run it"),
        (page(&names("`tests/later.rs::adds`")), "Cargo.toml does not run it"),
        (page(&names("`tests/capi/heap.c::frees`")), "there is no such function, or it is not called"),
        (page(&names("`tests/capi/heap.c::idle`")), "there is no such function, or it is not called"),
        (page(&names("`tests/capi/stack.c`")), "tests/capi/run.sh does not run it"),
        (page(&names("`tools/sizes.sh`")), ".ci/run does not run it"),
        (page(&names("`README.md`")), "neither a Rust test"),
    ];
    for (page, expected) in cases {
        let faults = check(&page, &small).expect_err(&page);
        assert_eq!(faults.len(), 1, "{faults:?}");
        assert!(faults[0].contains(expected), "\"{expected}\" is not in {faults:?}");
    }
}

/// The numbers of a cell such as "-20 to -22, -24".
fn numbers(cell: &str) -> Vec<i32> {
    let number = |text: &str| text.trim().parse::<i32>().unwrap_or_else(|error| panic!("{cell}: {error}"));
    let part = |part: &str| match part.split_once(" to ") {
        Some((first, last)) => (number(last)..=number(first)).collect(),
        None => vec![number(part)],
    };
    cell.split(',').flat_map(part).collect()
}

#[test]
fn the_table_of_statuses_has_those_of_the_header() {
    let read = |name: &str| std::fs::read_to_string(Path::new(env!("CARGO_MANIFEST_DIR")).join(name)).unwrap();
    let (header, page) = (read("include/supple.h"), read("docs/embedding.md"));
    let (_, known) = header.split_once("enum supple_status").unwrap();
    let (known, _) = known.split_once('}').unwrap();
    let known = known.lines().filter_map(|line| line.split_once(" = ")?.1.trim_end_matches(',').parse().ok());
    let (_, table) = page.split_once("| `SUPPLE_OK` |").unwrap();
    let rows = table.lines().skip(1).take_while(|line| line.starts_with('|'));
    let told = rows.flat_map(|line| numbers(line.split('|').nth(2).unwrap()));
    let told: HashSet<i32> = told.chain([0]).collect();
    assert_eq!(told, known.collect());
}
