//! `supple liver`: the liver of the demo as JSON on standard output, in SI units, on the mesh before it is refined,
//! which a browser moves in real time. Of it tools/page.sh makes the web page.

use serde_json::json;
use supple::material::Law as _;

use super::{BREATH, FRICTION, RADIUS, SETTLED, Steps, TARGET, TARGET_RADIUS, TUBES, lobe};
use crate::problem::{End, Problem};
use crate::screen::output;

pub(crate) fn liver() -> Result<End, Problem> {
    let setup = super::liver(lobe()?, Steps::Long);
    let material = setup.tissues.material(setup.element);
    let tissues = material.tissues.iter().map(|of| json!({ "constants": of.constants, "density": of.density }));
    let vessels = TUBES.map(|(from, to, radius)| json!({ "from": from, "to": to, "radius": radius }));
    let scene = json!({
        "points": setup.body.mesh.points.as_flattened(),
        "tetrahedra": setup.body.mesh.tets.as_flattened(),
        "triangles": setup.body.boundary().as_flattened(),
        "element": setup.element.name(),
        "law": material.law.name(),
        "tissues": tissues.collect::<Vec<_>>(),
        "tissueOfElement": material.of_element,
        "moved": setup.motions.iter().map(|motion| motion.node).collect::<Vec<_>>(),
        "breath": BREATH,
        "gravity": setup.gravity,
        "damping": setup.damping,
        "settled": SETTLED,
        "tumour": { "centre": TARGET, "radius": TARGET_RADIUS },
        "vessels": vessels,
        "probe": { "radius": RADIUS, "friction": FRICTION },
    });
    output!("{scene}");
    Ok(End::Reached)
}
