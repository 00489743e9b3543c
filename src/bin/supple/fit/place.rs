//! Values of a scene file, named by their place: `damping`, `material.c`, `force[0].newton`, `region[1].young`. A value
//! is changed in the file's text, so that any key that a scene file has or will have can be one.
//!
//! | place | what the value is |
//! |---|---|
//! | of a number | the number, in the unit of the scene file |
//! | of three numbers, as `gravity` or `force[0].newton` | a factor on them |
//! | `clock` | no value: when the scene starts, s on the clock of what was measured |
//! | `young`, `poisson` in `material` or a `region` | Young's modulus (Pa) or Poisson's ratio at rest, by the law's constants |
//!
//! Young's modulus changes all constants in Pa in proportion, Poisson's ratio `d`, which is half the bulk modulus in
//! each law, and the others by what keeps Young's modulus.

use std::ops::Range;

use supple::material::{AnyLaw, Law, MAX_CONSTANTS};
use toml::Spanned;
use toml::de::{DeTable, DeValue};

/// The path to a value.
pub(crate) struct Place {
    steps: Vec<Step>,
    name: String,
}

#[derive(Clone)]
enum Step {
    Key(String),
    Index(usize),
}

/// A change of a text: what stands at a range becomes something else.
pub(crate) struct Edit {
    range: Range<usize>,
    pub(crate) key: String,
    pub(crate) value: String,
}

impl Place {
    /// Reads `key.key[index].key`.
    pub(crate) fn parse(name: &str) -> Result<Self, String> {
        let wrong = || {
            format!("\"{name}\" is not the place of a value; write one as in \"material.young\" or \"force[0].newton\"")
        };
        let mut steps = vec![];
        for part in name.split('.') {
            let (key, indices) = part.find('[').map_or((part, ""), |at| part.split_at(at));
            if key.is_empty() || !key.chars().all(|letter| letter.is_ascii_alphanumeric() || "_-".contains(letter)) {
                return Err(wrong());
            }
            steps.push(Step::Key(key.into()));
            for index in indices.split_terminator(']') {
                let index = index.strip_prefix('[').and_then(|index| index.parse().ok()).ok_or_else(wrong)?;
                steps.push(Step::Index(index));
            }
            if !indices.is_empty() && !indices.ends_with(']') {
                return Err(wrong());
            }
        }
        Ok(Self { steps, name: name.into() })
    }

    pub(crate) fn name(&self) -> &str {
        &self.name
    }

    /// Whether it is no value of the scene, but the time on the clock of what was measured at which the scene starts, s.
    pub(crate) fn is_clock(&self) -> bool {
        self.name == "clock"
    }

    /// The last key.
    pub(crate) fn key(&self) -> &str {
        let keys = self
            .steps
            .iter()
            .rev()
            .filter_map(|step| if let Step::Key(key) = step { Some(key.as_str()) } else { None });
        keys.into_iter().next().unwrap_or_default()
    }

    /// Whether displacements at rest go nearly as one over the value.
    pub(crate) fn is_stiffness(&self) -> bool {
        ["young", "stiffness", "a", "c", "d", "e"].contains(&self.key())
    }

    /// What to change in a scene's text for a value.
    pub(crate) fn edits(&self, text: &str, value: f64) -> Result<Vec<Edit>, String> {
        let root = DeTable::parse(text).map_err(|error| error.message().to_owned())?;
        if matches!(self.key(), "young" | "poisson")
            && let Some((Step::Key(key), table)) = self.steps.split_last()
        {
            return moduli_edits(root.get_ref(), table, key, value);
        }
        let found = self.find(root.get_ref(), &self.steps)?;
        let edit = |at: &Spanned<DeValue<'_>>, value: f64| Edit {
            range: at.span(),
            key: self.name.clone(),
            value: written(value),
        };
        if number(found.get_ref()).is_some() {
            return Ok(vec![edit(found, value)]);
        }
        let vector = found.get_ref().as_array().filter(|array| array.len() == 3);
        let components = vector
            .and_then(|array| array.iter().map(|at| Some((at, number(at.get_ref())?))).collect::<Option<Vec<_>>>());
        let components =
            components.ok_or_else(|| format!("{} is neither a number nor three numbers in the scene", self.name))?;
        let edits = components.into_iter().enumerate().map(|(axis, (at, component))| Edit {
            key: format!("{}[{axis}]", self.name),
            ..edit(at, component * value)
        });
        Ok(edits.collect())
    }

    fn find<'a, 'i>(&self, root: &'a DeTable<'i>, steps: &[Step]) -> Result<&'a Spanned<DeValue<'i>>, String> {
        let missing = |what| {
            format!("the scene has no value {}: {what} is not there; write it, so that it can be changed", self.name)
        };
        find(root, steps).map_err(missing)
    }
}

/// The value at the end of a path; else the part of the path that is not there.
fn find<'a, 'i>(root: &'a DeTable<'i>, steps: &[Step]) -> Result<&'a Spanned<DeValue<'i>>, String> {
    let mut path = String::new();
    let mut at: Option<&'a Spanned<DeValue<'i>>> = None;
    for step in steps {
        match step {
            Step::Key(key) if path.is_empty() => path.clone_from(key),
            Step::Key(key) => path = format!("{path}.{key}"),
            Step::Index(index) => path = format!("{path}[{index}]"),
        }
        let next = match (step, at) {
            (Step::Key(key), None) => root.get(key.as_str()),
            (Step::Key(key), Some(at)) => at.get_ref().get(key.as_str()),
            (Step::Index(index), at) => at.and_then(|at| at.get_ref().get(*index)),
        };
        let Some(next) = next else { return Err(path) };
        at = Some(next);
    }
    at.ok_or(path)
}

fn number(value: &DeValue<'_>) -> Option<f64> {
    let digits = match value {
        DeValue::Float(float) => float.as_str(),
        DeValue::Integer(integer) if integer.radix() == 10 => integer.as_str(),
        _ => return None,
    };
    digits.parse().ok()
}

/// As TOML reads it back to the bit.
fn written(value: f64) -> String {
    format!("{value:?}")
}

/// The text with changes made.
pub(crate) fn edited(text: &str, edits: &mut [Edit]) -> String {
    edits.sort_by_key(|edit| std::cmp::Reverse(edit.range.start));
    let mut text = text.to_owned();
    for edit in edits {
        text.replace_range(edit.range.clone(), &edit.value);
    }
    text
}

/// The constants of a law for a Young's modulus (Pa) or a Poisson's ratio.
fn moduli_edits(root: &DeTable<'_>, table: &[Step], key: &str, value: f64) -> Result<Vec<Edit>, String> {
    let law = [Step::Key("material".into()), Step::Key("law".into())];
    let law = find(root, &law).ok().and_then(|law| law.get_ref().as_str());
    let law = law.and_then(|name| AnyLaw::all().find(|law| law.name() == name)).ok_or("the scene has no known law")?;
    let mut values = law.values();
    let mut places = [const { None }; MAX_CONSTANTS];
    for (index, constant) in law.constants().iter().enumerate() {
        let steps: Vec<Step> = table.iter().cloned().chain([Step::Key(constant.name.into())]).collect();
        let found = find(root, &steps).ok().and_then(|at| Some((at.span(), number(at.get_ref())?)));
        let (span, number) = found.ok_or_else(|| {
            format!("{key} needs the constant {} of the law {} in the same table", constant.name, law.name())
        })?;
        values[index] = number as f32;
        places[index] = Some((span, number));
    }
    let moduli = law.with(values).moduli();
    let young = moduli.young();
    let (shear, bulk) = if key == "young" {
        (value / young, value / young)
    } else {
        (young / (2.0 * (1.0 + value)) / moduli.shear, young / (3.0 * (1.0 - 2.0 * value)) / moduli.bulk)
    };
    let constants = law.constants().iter().zip(places).filter(|(constant, _)| constant.unit == "Pa");
    let edits = constants.filter_map(|(constant, place)| {
        let (range, number) = place?;
        let factor = if constant.name == "d" { bulk } else { shear };
        Some(Edit { range, key: constant.name.into(), value: written(number * factor) })
    });
    Ok(edits.collect())
}

#[cfg(test)]
mod tests {
    use super::*;

    const SCENE: &str = "damping = 5\ngravity = [0.0, -2.0, 0.5]\n[material]\nlaw = \"exponential\"\na = 1500.0 # Pa\nb = 8.0\nd = 40000.0\n\
                         [[force]]\nnewton = [0.0, 0.0, 1.0]\n[[force]]\nnewton = [1.0, 0.0, 0.0]\n";

    fn changed(place: &str, value: f64) -> Result<String, String> {
        let mut edits = Place::parse(place)?.edits(SCENE, value)?;
        Ok(edited(SCENE, &mut edits))
    }

    #[test]
    fn a_number_is_put_where_it_stood() {
        assert_eq!(changed("damping", 7.25).unwrap(), SCENE.replace("damping = 5", "damping = 7.25"));
        assert_eq!(changed("material.a", 2e3).unwrap(), SCENE.replace("1500.0 # Pa", "2000.0 # Pa"));
        assert_eq!(changed("force[1].newton[0]", 3.0).unwrap(), SCENE.replace("[1.0, 0.0, 0.0]", "[3.0, 0.0, 0.0]"));
    }

    #[test]
    fn three_numbers_are_multiplied() {
        assert_eq!(changed("gravity", 0.5).unwrap(), SCENE.replace("[0.0, -2.0, 0.5]", "[0.0, -1.0, 0.25]"));
        assert_eq!(changed("force[0].newton", 4.0).unwrap(), SCENE.replace("[0.0, 0.0, 1.0]", "[0.0, 0.0, 4.0]"));
    }

    /// The shear modulus is `a`, the bulk modulus `2 d`: `E = 9 K mu / (3 K + mu)`, `nu = (3 K - 2 mu) / (2 (3 K + mu))`.
    #[test]
    fn moduli_change_the_laws_constants() {
        let read = |text: &str| {
            let table: toml::Table = toml::from_str(text).unwrap();
            let constant = |name: &str| table["material"][name].as_float().unwrap();
            assert_eq!(constant("b"), 8.0);
            let (shear, bulk) = (constant("a"), 2.0 * constant("d"));
            (9.0 * bulk * shear / (3.0 * bulk + shear), (3.0 * bulk - 2.0 * shear) / (2.0 * (3.0 * bulk + shear)))
        };
        let (young, poisson) = read(SCENE);
        let (stiffer, same) = read(&changed("material.young", 9000.0).unwrap());
        assert!((stiffer / 9000.0 - 1.0).abs() < 1e-6 && (same - poisson).abs() < 1e-9, "{stiffer} {same}");
        let (same, less) = read(&changed("material.poisson", 0.4).unwrap());
        assert!((same / young - 1.0).abs() < 1e-6 && (less - 0.4).abs() < 1e-6, "{same} {less}");
    }

    #[test]
    fn what_is_not_there_is_told() {
        let place = |place: &str| changed(place, 1.0).unwrap_err();
        let missing =
            "the scene has no value force[2].newton: force[2] is not there; write it, so that it can be changed";
        assert_eq!(place("force[2].newton"), missing);
        assert!(place("spring[0].stiffness").contains("spring[0].stiffness: spring is not there"));
        assert!(place("material.law").contains("neither a number nor three numbers"));
        for wrong in ["", "a..b", "force[", "force[x].newton", "force[0]x", "a b"] {
            assert!(place(wrong).contains("is not the place of a value"), "{wrong}");
        }
    }
}
