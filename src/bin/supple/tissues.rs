//! The law and the constants of a scene file's tissues.

use toml::Spanned;

use crate::body::Body;
use crate::scene_file::{MaterialTable, Problem, RegionTable, SceneFile, Selection};
use crate::select::inside;

type Tissues = (String, Vec<[f32; 5]>, Vec<u16>);

pub(crate) fn read_tissues(file: &SceneFile, body: &Body) -> Result<Tissues, Problem> {
    let at = &file.scene.material;
    let MaterialTable { law, a, b, c, d, density } = at.get_ref();
    let wanted = match law.get_ref().as_str() {
        "neo-hookean" | "neo-hookean-literal" => [("a", false), ("b", false), ("c", true), ("d", true)],
        "exponential" | "exponential-literal" => [("a", true), ("b", true), ("c", false), ("d", true)],
        other => {
            let known =
                "\"neo-hookean\", \"exponential\", \"neo-hookean-literal\" and \"exponential-literal\" are";
            return Err(file.problem(law, format!("law \"{other}\" is not known; {known}")));
        }
    };
    let mut base = [0.0; 5];
    for ((name, needed), (slot, given)) in wanted.iter().zip(base.iter_mut().zip([a, b, c, d])) {
        match (needed, given) {
            (true, Some(value)) => *slot = positive(file, name, value)?,
            (true, None) => return Err(file.problem(at, format!("the law {} needs {name}", law.get_ref()))),
            (false, Some(value)) => {
                return Err(file.problem(value, format!("the law {} has no constant {name}", law.get_ref())));
            }
            (false, None) => {}
        }
    }
    base[4] = positive(file, "density", density)?;
    let mut tissues = vec![base];
    let mut of_element = vec![0; body.mesh.tets.len()];
    for at in &file.scene.region {
        let RegionTable { tags, plane, bounds, a, b, c, d, density } = at.get_ref();
        let mut tissue = base;
        for ((name, needed), (slot, given)) in wanted.iter().zip(tissue.iter_mut().zip([a, b, c, d])) {
            if let Some(value) = given {
                if !needed {
                    return Err(
                        file.problem(value, format!("the law {} has no constant {name}", law.get_ref()))
                    );
                }
                *slot = positive(file, name, value)?;
            }
        }
        if let Some(density) = density {
            tissue[4] = positive(file, "density", density)?;
        }
        let index = u16::try_from(tissues.len()).map_err(|_| file.problem(at, "more than 65,535 regions"))?;
        let mut any = false;
        let mut assign = |element: usize| {
            of_element[element] = index;
            any = true;
        };
        if let Some(tags) = tags {
            if plane.is_some() || bounds.is_some() {
                return Err(file.problem(at, "give exactly one of tags, plane and box"));
            }
            let tagged = body.mesh.regions.iter().enumerate().filter(|(_, tag)| tags.contains(tag));
            tagged.for_each(|(element, _)| assign(element));
        } else {
            let selection = Selection { nodes: None, plane: *plane, bounds: *bounds };
            let inside = inside(file, at, &selection, body)?;
            for (element, tet) in body.mesh.tets.iter().enumerate() {
                let corners = tet.map(|node| body.mesh.points[node as usize]);
                if inside([0, 1, 2].map(|axis| corners.iter().map(|corner| corner[axis]).sum::<f64>() / 4.0))
                {
                    assign(element);
                }
            }
        }
        if !any {
            return Err(
                file.problem(at, "this region selects no element (by tag, or by the middle of the element)")
            );
        }
        tissues.push(tissue);
    }
    Ok((law.get_ref().clone(), tissues, of_element))
}

fn positive(file: &SceneFile, name: &str, at: &Spanned<f32>) -> Result<f32, Problem> {
    let value = *at.get_ref();
    if !(value.is_finite() && value > 0.0) {
        return Err(file.problem(at, format!("{name} is {value}, it must be a positive number")));
    }
    Ok(value)
}
