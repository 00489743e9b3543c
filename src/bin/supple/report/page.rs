//! The page of a report: words and tables as HTML, which are read without a script as well, and figures as JSON, which
//! `page.js` draws with plotly.js. `page.html` is a format string: the compiler checks that each name in braces has a
//! value.

use super::{Figure, ReportPart, Section, Table};
use crate::problem::Problem;

const LIBRARY: &str = include_str!("plotly/plotly-gl3d.min.js");

/// Rows of a table that is open; a longer one opens on demand.
const OPEN: usize = 20;

/// The page, complete.
pub(crate) fn page(title: &str, parts: &[ReportPart]) -> Result<String, Problem> {
    let parts = parts.iter().map(part).collect::<Result<String, _>>().map_err(Problem::of)?;
    Ok(format!(
        include_str!("page.html"),
        title = escaped(title),
        style = include_str!("page.css"),
        parts = parts,
        library = LIBRARY,
        script = include_str!("page.js"),
    ))
}

fn part(ReportPart { made, sections }: &ReportPart) -> serde_json::Result<String> {
    let line = |(name, words)| format!("<dt>{name}</dt><dd>{}</dd>\n", escaped(words));
    let lines = made.lines().map(line).concat();
    let sections = sections.iter().map(section).collect::<Result<String, _>>()?;
    let written = format!("<dt>written</dt><dd><time data-seconds=\"{}\"></time></dd>", made.seconds);
    Ok(format!("<div class=\"part\">\n<dl>\n{lines}{written}\n</dl>\n{sections}</div>\n"))
}

fn section(section: &Section) -> serde_json::Result<String> {
    let Section { title, paragraphs, tables, figures, listing } = section;
    let mut html = format!("<section>\n<h2>{}</h2>\n", escaped(title));
    html.extend(paragraphs.iter().map(|words| format!("<p>{}</p>\n", escaped(words))));
    html.extend(tables.iter().map(table));
    html.extend(listing.iter().map(|words| format!("<pre class=\"wide\">{}</pre>\n", escaped(words))));
    for figure in figures {
        html += &self::figure(figure)?;
    }
    Ok(html + "</section>\n")
}

fn table(Table { title, heads, rows }: &Table) -> String {
    let open = if rows.len() > OPEN { "" } else { " open" };
    let title = escaped(title);
    let heads: String = heads.iter().map(|head| format!("<th>{}</th>", escaped(head))).collect();
    let row = |cells: &Vec<String>| {
        let cells: String = cells.iter().map(|words| cell(words)).collect();
        format!("<tr>{cells}</tr>\n")
    };
    let rows: String = rows.iter().map(row).collect();
    format!(
        "<details{open}>\n<summary>{title}</summary>\n<div class=\"wide\"><table>\n<thead><tr>{heads}</tr></thead>\n\
         <tbody>\n{rows}</tbody>\n</table></div>\n</details>\n"
    )
}

/// Numbers stand to the right.
fn cell(words: &str) -> String {
    let class = if words.parse::<f64>().is_ok() || words == "-" { " class=\"number\"" } else { "" };
    format!("<td{class}>{}</td>", escaped(words))
}

fn figure(figure: &Figure) -> serde_json::Result<String> {
    // In JSON `<` is only in strings; none of them can end the script or begin another.
    let json = serde_json::to_string(figure)?.replace('<', "\\u003c");
    let caption = escaped(&figure.caption);
    Ok(format!(
        "<figure>\n<script type=\"application/json\">{json}</script>\n<figcaption>{caption}</figcaption>\n</figure>\n"
    ))
}

/// Words as they stand between tags.
fn escaped(words: &str) -> String {
    words.replace('&', "&amp;").replace('<', "&lt;").replace('>', "&gt;")
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::report::Panel;
    use crate::report::made::Made;
    use crate::report::plots::{self, Curve};

    /// A page of one part with these sections.
    fn page_of(section: Section) -> String {
        page(
            "a & b",
            &[ReportPart { made: Made::now(&["supple".into(), "<x>".into()], "none"), sections: vec![section] }],
        )
        .unwrap()
    }

    #[test]
    fn a_page_holds_all_that_it_needs() {
        let page = page_of(Section::default());
        assert!(page.contains(LIBRARY) && page.contains(include_str!("page.js")));
        assert!(page.contains(include_str!("page.css")));
        // Nothing in the library or the script ends its element early.
        assert_eq!(page.matches("</script").count(), 2);
        assert!(!page.contains("<!--"));
    }

    #[test]
    fn the_library_says_whose_it_is_and_under_which_licence() {
        let head = LIBRARY.get(..200).unwrap();
        assert!(head.contains("plotly.js") && head.contains("Plotly, Inc.") && head.contains("MIT license"));
    }

    #[test]
    fn words_stay_words() {
        let words = "</script><b> & {title}";
        let section = Section {
            title: words.into(),
            paragraphs: vec![words.into()],
            listing: Some(words.into()),
            ..Section::default()
        };
        let page = page_of(section);
        let written = "&lt;/script&gt;&lt;b&gt; &amp; {title}";
        for (before, after) in [("<h2>", "</h2>"), ("<p>", "</p>"), ("<pre class=\"wide\">", "</pre>")] {
            assert!(page.contains(&format!("{before}{written}{after}")), "{before}");
        }
        assert!(page.contains("<title>a &amp; b</title>") && page.contains("<dd>supple '&lt;x&gt;'</dd>"));
    }

    #[test]
    fn numbers_of_tables_stand_to_the_right_and_long_tables_are_closed() {
        let row = vec!["<b>".into(), "-0.5".into(), "-".into(), "diverged".into()];
        let cells = "<td>&lt;b&gt;</td><td class=\"number\">-0.5</td><td class=\"number\">-</td><td>diverged</td>";
        for (rows, opened) in [(OPEN, "<details open>"), (OPEN + 1, "<details>")] {
            let table = Table { title: "all".into(), heads: vec![], rows: vec![row.clone(); rows] };
            let page = page_of(Section { tables: vec![table], ..Section::default() });
            assert!(page.contains(opened));
            assert_eq!(page.matches(cells).count(), rows);
        }
    }

    #[test]
    fn figures_come_back_whatever_they_say() {
        let name = "</script><!--<script>";
        let plot = plots::linear("time, s", "mm", vec![Curve::new(name, vec![1.0], vec![3.0])]);
        let figures = vec![Figure::choice("below", vec![Panel::new("one", plot)])];
        let page = page_of(Section { figures, ..Section::default() });
        let data = page.split("<script type=\"application/json\">").nth(1).unwrap();
        let figure: Figure = serde_json::from_str(data.split("</script>").next().unwrap()).unwrap();
        assert_eq!(figure.panels[0].plot.data[0]["name"], name);
    }
}
