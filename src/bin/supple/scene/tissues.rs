//! What a scene is made of: the tissue of `[material]`, and of each `[[region]]` that differs from it.

use std::collections::BTreeSet;
use std::fmt;

use serde::de::DeserializeOwned;
use supple::material::{AnyLaw, Directions, Element, FIBRE_NAMES, Fibres, Law, Moduli, Prony, Tissue, VecMaterial};
use supple::mlp::Recipe;
use supple::plausibility::same;
use toml::Spanned;

use super::body::Body;
use super::directions;
use super::file::{SceneFile, Selection, TissueTable};
use super::select::inside;
use crate::problem::Problem;

/// Tissues of one law.
pub struct Tissues {
    /// That of `[material]`, then of each region.
    tissues: Vec<Tissue<AnyLaw>>,
    /// How each relaxes.
    prony: Vec<Prony>,
    /// The fibres of each.
    fibres: Vec<Fibres>,
    /// Their directions in each element; empty if there are none.
    directions: Vec<Directions>,
    /// For each element the index of its tissue; empty if all are of one.
    of_element: Vec<u16>,
}

/// Keys of `[material]` that are no constants of a law; a region has the same but for the law.
const KEYS: [&str; 6] = ["law", "density", "prony", FIBRE_NAMES[0], FIBRE_NAMES[1], FIBRE_NAMES[2]];

impl Tissues {
    /// The same everywhere.
    pub(crate) fn one(tissue: Tissue<AnyLaw>) -> Self {
        Self::several(vec![tissue], vec![])
    }

    /// Of each element the one with this index.
    pub(crate) fn several(tissues: Vec<Tissue<AnyLaw>>, of_element: Vec<u16>) -> Self {
        let (prony, fibres) = (vec![Prony::NONE; tissues.len()], vec![Fibres::NONE; tissues.len()]);
        Self { tissues, prony, fibres, directions: vec![], of_element }
    }

    pub(crate) fn read(file: &SceneFile, body: &Body) -> Result<Self, Problem> {
        let material = Table::new(file, &file.scene.material, &KEYS)?;
        let law = read_law(file, &material.required("law")?)?;
        let density = material.required("density")?;
        let base = Tissue { law: material.constants(law, true)?, density: positive(file, "density", &density)? };
        let mut tissues = vec![base];
        let mut prony = vec![material.prony()?.unwrap_or(Prony::NONE)];
        let mut fibres = vec![material.fibres(Fibres::NONE)?];
        let mut of_element = vec![0; body.mesh.tets.len()];
        for at in &file.scene.region {
            let region = Table::new(file, at, &[&["tags", "plane", "box"], &KEYS[1..]].concat())?;
            let law = region.constants(base.law, false)?;
            let density = match region.get("density")? {
                Some(density) => positive(file, "density", &density)?,
                None => base.density,
            };
            let index = u16::try_from(tissues.len());
            let index = index.map_err(|_| file.problem(at, "more than 65,535 regions"))?;
            for element in region.elements(body)? {
                of_element[element] = index;
            }
            tissues.push(Tissue { law, density });
            prony.push(region.prony()?.unwrap_or(prony[0]));
            fibres.push(region.fibres(fibres[0])?);
        }
        let directions = match &file.scene.directions {
            Some(at) if !fibres.iter().any(Fibres::are_there) => {
                return Err(file.problem(at, "no tissue has fibres: give fibres = [a, b] under [material]"));
            }
            Some(at) => directions::read(file, at, body)?,
            None if fibres.iter().any(Fibres::are_there) => {
                return Err(file.problem(&file.scene.material, "tissue with fibres needs [directions]"));
            }
            None => vec![],
        };
        Ok(Self { tissues, prony, fibres, directions, of_element })
    }

    /// The elements of the tissue with this index.
    pub(crate) fn elements_of(&self, tissue: u16) -> impl Iterator<Item = usize> {
        self.of_element.iter().enumerate().filter(move |(_, of)| **of == tissue).map(|(element, _)| element)
    }

    /// The directions of fibres in each element; empty if there are none.
    pub(crate) fn directions(&self) -> &[Directions] {
        &self.directions
    }

    /// The tissue, if there is only one.
    pub fn only(&self) -> Option<Tissue<AnyLaw>> {
        if let [only] = *self.tissues { Some(only) } else { None }
    }

    /// Of each tissue, that of `[material]` first.
    pub(crate) fn moduli(&self) -> impl Iterator<Item = Moduli> {
        self.tissues.iter().map(|tissue| tissue.law.moduli())
    }

    /// Density, kg/m^3, and moduli of each tissue, that of `[material]` first.
    pub(crate) fn of_regions(&self) -> impl Iterator<Item = (f32, Moduli)> {
        self.tissues.iter().map(|tissue| (tissue.density, tissue.law.moduli()))
    }

    /// The mass of a body of these tissues, kg.
    pub(crate) fn mass(&self, body: &Body) -> f64 {
        let index = |element: usize| self.of_element.get(element).map_or(0, |&index| usize::from(index));
        let density = |element: usize| f64::from(self.tissues[index(element)].density);
        body.volumes().enumerate().map(|(element, volume)| volume * density(element)).sum()
    }

    /// Whether all of it is the tissue that a network learned from.
    pub(crate) fn is_of(&self, recipe: &Recipe<'_>) -> bool {
        let same_tissue = |Tissue { law, density }: &Tissue<AnyLaw>| {
            let mut constants = law.values().into_iter().zip(recipe.law.values());
            law.name() == recipe.law.name()
                && same(*density, recipe.density)
                && constants.all(|(here, there)| same(here, there))
        };
        self.tissues.iter().all(same_tissue)
    }

    /// Whether some of them relaxes.
    pub(crate) fn relax(&self) -> bool {
        self.prony.iter().any(|series| *series != Prony::NONE)
    }

    /// Whether some of them have fibres.
    pub(crate) fn have_fibres(&self) -> bool {
        self.fibres.iter().any(Fibres::are_there)
    }

    /// What a scene of these tissues in these tetrahedra is made of.
    pub(crate) fn material(&self, element: Element) -> VecMaterial {
        let law = self.tissues[0].law;
        let tissues = self.tissues.iter().map(Tissue::values).collect();
        let prony = if self.relax() { self.prony.clone() } else { vec![] };
        let fibres = if self.have_fibres() { self.fibres.clone() } else { vec![] };
        let (of_element, directions) = (self.of_element.clone(), self.directions.clone());
        VecMaterial { element, law, tissues, of_element, prony, fibres, directions }
    }
}

impl fmt::Display for Tissues {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Tissue { law, density } = &self.tissues[0];
        write!(f, "{law}, {density} kg/m^3")?;
        if self.prony[0] != Prony::NONE {
            write!(f, ", relaxes: {}", self.prony[0])?;
        }
        if self.fibres[0].are_there() {
            write!(f, ", {}", self.fibres[0])?;
        }
        match self.tissues.len() - 1 {
            0 => Ok(()),
            1 => write!(f, ", 1 further region"),
            more => write!(f, ", {more} further regions"),
        }
    }
}

/// The elements of a `[[region]]`, those of later ones among them.
pub(crate) fn elements_of_region(
    file: &SceneFile,
    at: &Spanned<TissueTable>,
    body: &Body,
) -> Result<Vec<usize>, Problem> {
    Table { file, at }.elements(body)
}

fn read_law(file: &SceneFile, at: &Spanned<String>) -> Result<AnyLaw, Problem> {
    let name = at.get_ref();
    AnyLaw::all().find(|law| law.name() == name).ok_or_else(|| {
        let mut known: Vec<_> = AnyLaw::all().map(|law| format!("\"{}\"", law.name())).collect();
        let last = known.pop().unwrap_or_default();
        file.problem(
            at,
            format!(
                "law \"{name}\" is not known; {} and {last} are, each with fibres = [a, b] if wanted",
                known.join(", ")
            ),
        )
    })
}

/// Names of the constants of all laws.
fn constant_names() -> BTreeSet<&'static str> {
    AnyLaw::all().flat_map(|law| law.constants()).map(|constant| constant.name).collect()
}

/// A table with constants of a law among its keys.
struct Table<'a> {
    file: &'a SceneFile,
    at: &'a Spanned<TissueTable>,
}

impl<'a> Table<'a> {
    /// A key that is neither one of `keys` nor a constant of some law is a problem.
    fn new(file: &'a SceneFile, at: &'a Spanned<TissueTable>, keys: &[&str]) -> Result<Self, Problem> {
        let names = constant_names();
        let mut unknown =
            at.get_ref().iter().filter(|(key, _)| !keys.contains(&key.as_str()) && !names.contains(key.as_str()));
        match unknown.next() {
            Some((key, value)) => {
                let known: Vec<_> = keys.iter().chain(&names).map(|key| format!("`{key}`")).collect();
                Err(file.problem(value, format!("unknown field `{key}`, expected one of {}", known.join(", "))))
            }
            None => Ok(Self { file, at }),
        }
    }

    fn get<T: DeserializeOwned>(&self, key: &str) -> Result<Option<Spanned<T>>, Problem> {
        let Some(value) = self.at.get_ref().get(key) else {
            return Ok(None);
        };
        match value.get_ref().clone().try_into() {
            Ok(read) => Ok(Some(Spanned::new(value.span(), read))),
            Err(error) => Err(self.file.problem(value, error.message())),
        }
    }

    fn required<T: DeserializeOwned>(&self, key: &str) -> Result<Spanned<T>, Problem> {
        self.get(key)?.ok_or_else(|| self.file.problem(self.at, format!("missing field `{key}`")))
    }

    /// The law with the constants that are given; with `complete` they must be all that it has.
    fn constants(&self, law: AnyLaw, complete: bool) -> Result<AnyLaw, Problem> {
        let mut values = law.values();
        for name in constant_names() {
            let place = law.constants().iter().position(|constant| constant.name == name);
            match (place, self.get(name)?) {
                (Some(place), Some(value)) => values[place] = positive(self.file, name, &value)?,
                (None, Some(value)) => {
                    let message = format!("the law {} has no constant {name}", law.name());
                    return Err(self.file.problem::<f32>(&value, message));
                }
                (Some(_), None) if complete => {
                    return Err(self.file.problem(self.at, format!("the law {} needs {name}", law.name())));
                }
                _ => {}
            }
        }
        Ok(law.with(values))
    }

    /// The terms of relaxation, if they are given: an empty list is none.
    fn prony(&self) -> Result<Option<Prony>, Problem> {
        let Some(terms) = self.get::<Vec<[f32; 2]>>("prony")? else { return Ok(None) };
        let series = Prony::new(terms.get_ref());
        series
            .map(Some)
            .map_err(|error| self.file.problem(&terms, format!("{error} (prony = [[share, seconds], ...])")))
    }

    /// The fibres, of which what is not given is that of `others`: an empty list is no such term.
    fn fibres(&self, others: Fibres) -> Result<Fibres, Problem> {
        let mut terms = others.terms().map(|[a, b]| (a > 0.0).then_some([a, b]));
        let mut fibres = others;
        for (term, key) in FIBRE_NAMES.into_iter().enumerate() {
            let Some(given) = self.get::<Vec<f32>>(key)? else { continue };
            terms[term] = match given.get_ref()[..] {
                [] => None,
                [a, b] => Some([a, b]),
                _ => return Err(self.file.problem(&given, format!("{key} = [a, b]: a in Pa, b without unit"))),
            };
            fibres = Fibres::new(terms).map_err(|error| self.file.problem(&given, error))?;
        }
        Ok(fibres)
    }

    /// The elements of a region, by tag or by their middle; none is an error.
    fn elements(&self, body: &Body) -> Result<Vec<usize>, Problem> {
        let Self { file, at } = self;
        let tags = self.get::<Vec<i32>>("tags")?;
        let plane = self.get("plane")?.map(Spanned::into_inner);
        let bounds = self.get("box")?.map(Spanned::into_inner);
        let elements: Vec<_> = if let Some(tags) = tags {
            if plane.is_some() || bounds.is_some() {
                return Err(file.problem(at, "give exactly one of tags, plane and box"));
            }
            let tagged = body.mesh.regions.iter().enumerate();
            tagged.filter(|(_, tag)| tags.get_ref().contains(tag)).map(|(element, _)| element).collect()
        } else {
            let inside = inside(file, at, &Selection { nodes: None, plane, bounds }, "tags", body)?;
            let middle = |tet: [u32; 4]| {
                let corners = tet.map(|node| body.places()[node as usize]);
                [0, 1, 2].map(|axis| corners.iter().map(|corner| corner[axis]).sum::<f64>() / 4.0)
            };
            let tets = body.mesh.tets.iter().enumerate();
            tets.filter(|(_, tet)| inside(middle(**tet))).map(|(element, _)| element).collect()
        };
        if elements.is_empty() {
            let message = "this region selects no element (by tag, or by the middle of the element)";
            return Err(file.problem(at, message));
        }
        Ok(elements)
    }
}

fn positive(file: &SceneFile, name: &str, at: &Spanned<f32>) -> Result<f32, Problem> {
    let value = *at.get_ref();
    if !(value.is_finite() && value > 0.0) {
        return Err(file.problem(at, format!("{name} is {value}, it must be a positive number")));
    }
    Ok(value)
}
