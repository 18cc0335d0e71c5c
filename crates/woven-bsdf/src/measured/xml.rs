//! What the readers of BSDF XML share: elements by their local names, numbers, texts.

use super::Refused;
use roxmltree::{Document, Node};

/// The text of a file as a document.
pub(super) fn document(xml: &str) -> Result<Document<'_>, Refused> {
    Document::parse(xml).map_err(|e| {
        Refused::new(format!(
            "the XML is broken or cut off ({e}); fetch the file again"
        ))
    })
}

/// `has_tag_name` without the namespace, which files spell in several ways.
pub(super) fn is(node: Node<'_, '_>, name: &str) -> bool {
    node.is_element() && node.tag_name().name() == name
}

/// The first element of that name at or below `node`.
pub(super) fn find<'a, 'i>(node: Node<'a, 'i>, tag: &str) -> Option<Node<'a, 'i>> {
    node.descendants().find(|n| is(*n, tag))
}

/// The trimmed text of the first element of that name; empty if there is none.
pub(super) fn text<'a>(node: Node<'a, '_>, tag: &str) -> &'a str {
    find(node, tag).and_then(|n| n.text()).unwrap_or("").trim()
}

/// [`text`] as a finite number of the angle basis.
pub(super) fn number(node: Node<'_, '_>, tag: &str) -> Result<f64, Refused> {
    let text = text(node, tag);
    match text.parse::<f64>() {
        Ok(x) if x.is_finite() => Ok(x),
        _ => Err(Refused::new(format!(
            "the angle basis has {tag} = {text:?}, which is not a number"
        ))),
    }
}
