//! Which tetrahedra a person names, in scene files and on the command line.

use supple::material::Element;

pub fn element_named(name: &str) -> Result<Element, String> {
    Element::ALL.into_iter().find(|element| element.name() == name).ok_or_else(|| {
        let known = Element::ALL.map(|element| format!("\"{}\"", element.name())).join(", ");
        format!("element \"{name}\" is not known; {known} are")
    })
}
