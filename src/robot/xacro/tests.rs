//! Descriptions, with what Python and its own xacro make of them; and what is refused.

use super::*;

fn expanded(text: &str) -> Result<String> {
    expand(text, Path::new("arm.xacro"), &BTreeMap::new())
}

fn body(inside: &str) -> String {
    let text =
        format!("<robot xmlns:xacro=\"http://www.ros.org/wiki/xacro\" name=\"r\">{inside}</robot>");
    let out = expanded(&text).unwrap_or_else(|e| panic!("{inside}: {e}"));
    let out = out.split_once("<robot name=\"r\"").unwrap().1;
    let lines: Vec<&str> = out.lines().map(str::trim).collect();
    lines
        .concat()
        .trim_start_matches('>')
        .replace("</robot>", "")
}

fn value(expression: &str) -> String {
    let out = body(&format!("<a b=\"${{{expression}}}\"/>"));
    out.strip_prefix("<a b=\"")
        .unwrap()
        .strip_suffix("\"/>")
        .unwrap()
        .into()
}

fn refused(inside: &str) -> String {
    let text = format!("<robot xmlns:xacro=\"http://ros.org/xacro\" name=\"r\">\n{inside}</robot>");
    expanded(&text).unwrap_err().to_string()
}

#[test]
fn expressions_are_those_of_python() {
    for (text, wanted) in [
        ("2*3 + 1", "7"),
        ("7/2", "3.5"),
        ("-7//2", "-4"),
        ("-7 % 3", "2"),
        ("-2**2", "-4"),
        ("2**-1", "0.5"),
        ("2**3**2", "512"),
        ("1./12 * 3 * (3*0.1**2 + 0.2**2)", "0.0175"),
        ("'a' if 2 &gt; 1 else 'b'", "a"),
        ("'' if False else 'x' + '_'", "x_"),
        ("'y' in 'xyz' and not 'q' in 'xyz'", "True"),
        ("1 &lt; 2 &lt;= 2", "True"),
        ("'0 0 1.5'.split(' ')[2]", "1.5"),
        ("[1, 2, 3][-1]", "3"),
        ("[1, 2, 3][1:]", "[2, 3]"),
        ("len('abc') + max(1, 5, 3)", "8"),
        ("radians(180) == pi", "True"),
        ("round(2.5) + int(3.9)", "5"),
        ("str(1) + 'x'", "1x"),
        ("math.sqrt(16)", "4.0"),
        ("2*math.pi == tau", "True"),
        ("python.len('ab') + python.max(1, 2)", "4"),
        ("None == 0 or 3", "3"),
        ("dict(a=1.5, b='x')['b'] + str(dict(a=1.5).a)", "x1.5"),
        ("len(dict(dict(a=1)))", "1"),
    ] {
        assert_eq!(value(text), wanted, "{text}");
    }
}

#[test]
fn properties_macros_and_conditions() {
    // later properties, in any order
    assert_eq!(
        body(
            "<xacro:property name=\"a\" value=\"${b*2}\"/><xacro:property name=\"b\" value=\"3\"/><x v=\"${a}\"/>"
        ),
        "<x v=\"6\"/>"
    );
    // text stays text, numbers are numbers
    assert_eq!(
        body("<xacro:property name=\"a\" value=\"0.5\"/><x v=\"${a+1} $${a} ${'0.5'}\"/>"),
        "<x v=\"1.5 ${a} 0.5\"/>"
    );
    // parameters: given, by default, forwarded, blocks
    let text = "<xacro:property name=\"f\" value=\"2\"/><xacro:macro name=\"m\" params=\"a b:=7 f:=^ g:=^|'x y' *one **all\">\
                <x a=\"${a}\" b=\"${b}\" f=\"${f}\" g=\"${g}\"/><xacro:insert_block name=\"one\"/><xacro:insert_block name=\"all\"/>\
                </xacro:macro><xacro:m a=\"1\"><p/><q><r/><s/></q></xacro:m>";
    assert_eq!(
        body(text),
        "<x a=\"1\" b=\"7\" f=\"2\" g=\"x y\"/><p/><r/><s/>"
    );
    // a macro sets a property of its caller
    let text = "<xacro:macro name=\"m\"><xacro:property name=\"a\" value=\"9\" scope=\"parent\"/></xacro:macro><xacro:m/><x a=\"${a}\"/>";
    assert_eq!(body(text), "<x a=\"9\"/>");
    assert_eq!(
        body(
            "<xacro:if value=\"${1 == 1}\"><y/></xacro:if><xacro:unless value=\"true\"><z/></xacro:unless>"
        ),
        "<y/>"
    );
    // a name in text or behind a point is not the property that is stated anew
    let text = "<xacro:property name=\"m\" value=\"1\"/><xacro:property name=\"c\" value=\"${dict(m=4)}\"/>\
                <xacro:property name=\"m\" value=\"${c.m if 'm' in 'mn' else 0}\"/><x a=\"${m}\"/>";
    assert_eq!(body(text), "<x a=\"4\"/>");
    // a dictionary as the default of a parameter
    let text = "<xacro:macro name=\"m\" params=\"at:=${dict(turn=0.5,lift=-1)}\"><x a=\"${at['turn'] + at.lift}\"/></xacro:macro><xacro:m/>";
    assert_eq!(body(text), "<x a=\"-0.5\"/>");
    // arguments may stand below the line that needs them
    assert_eq!(
        body("<x a=\"$(arg n)\"/><xacro:arg name=\"n\" default=\"5\"/>"),
        "<x a=\"5\"/>"
    );
}

#[test]
fn elements_and_attributes_have_computed_names() {
    for (inside, wanted) in [
        (
            "<xacro:element xacro:name=\"${'a' + 'b'}\" x=\"${1+1}\"><c/></xacro:element>",
            "<ab x=\"2\"><c/></ab>",
        ),
        (
            "<xacro:element xacro:name=\"t\"><xacro:attribute name=\"a\" value=\"2\"/></xacro:element>",
            "<t a=\"2\"/>",
        ),
        // a name of xacro is an element of xacro
        (
            "<xacro:element xacro:name=\"xacro:if\" value=\"1\"><c/></xacro:element>",
            "<c/>",
        ),
        (
            "<t a=\"1\"><xacro:attribute name=\"a\" value=\"x${2*3}\"/><xacro:attribute name=\"${'z'}\" value=\"q\"/></t>",
            "<t a=\"x6\" z=\"q\"/>",
        ),
        // in a block that is passed on
        (
            "<xacro:macro name=\"m\" params=\"*b\"><xacro:insert_block name=\"b\"/></xacro:macro>\
             <xacro:m><t><xacro:attribute name=\"a\" value=\"2\"/></t></xacro:m>",
            "<t a=\"2\"/>",
        ),
        // xacro:if and macros are elements of their own, which do not stay
        (
            "<t><xacro:if value=\"1\"><xacro:attribute name=\"a\" value=\"2\"/><i/></xacro:if></t>",
            "<t><i/></t>",
        ),
    ] {
        assert_eq!(body(inside), wanted, "{inside}");
    }
    let text = "<robot xmlns:xacro=\"http://ros.org/xacro\" name=\"r\"><xacro:attribute name=\"name\" value=\"s\"/></robot>";
    assert!(expanded(text).unwrap().contains("<robot name=\"s\"/>"));
}

#[test]
fn parameters_and_arguments_are_read_as_ros_reads_them() {
    // spaces around the sign and in expressions; nothing behind the sign is no default
    let text = "<xacro:macro name=\"m\" params=\"a := 1 b=2 c:=${2 * 3} d:=$(arg n) e:='x y' f\"><x v=\"${a} ${b} ${c} ${d} ${e} ${f}\"/></xacro:macro>\
                <xacro:arg name=\"n\" default=\"7\"/><xacro:m f=\"8\"/>";
    assert_eq!(body(text), "<x v=\"1 2 6 7 x y 8\"/>");
    let said = refused("<xacro:macro name=\"m\" params=\"a:=\"/><xacro:m/>");
    assert!(said.contains("needs the parameter `a`"), "{said}");
    // an argument is text
    let text = "<xacro:arg name=\"n\" default=\"5\"/><x a=\"${xacro.arg('n') == '5'} ${xacro.arg('n') == 5}\"/>";
    assert_eq!(body(text), "<x a=\"True False\"/>");
    // a property is removed wherever it is seen
    let text = "<xacro:property name=\"p\" value=\"1\"/><xacro:macro name=\"m\"><xacro:property name=\"p\" remove=\"true\"/></xacro:macro>\
                <xacro:m/><xacro:property name=\"p\" default=\"2\"/><x a=\"${p}\"/>";
    assert_eq!(body(text), "<x a=\"2\"/>");
}

#[test]
fn what_cannot_be_expanded_is_said_with_line_and_name() {
    for (inside, wanted) in [
        ("<x a=\"${b}\"/>", "`b` is not defined"),
        ("<x a=\"$(arg b)\"/>", "the argument `b` has no value"),
        (
            "<x a=\"$(find no_such_package_here)\"/>",
            "no package `no_such_package_here`",
        ),
        ("<xacro:nothing/>", "no macro `nothing`"),
        (
            "<xacro:property name=\"a\" value=\"${a}\"/><x b=\"${a}\"/>",
            "needs itself",
        ),
        (
            "<xacro:property name=\"a\" value=\"${b}\"/><xacro:property name=\"b\" value=\"${a}\"/><x b=\"${a}\"/>",
            "needs itself",
        ),
        (
            "<xacro:macro name=\"m\"><xacro:m/></xacro:macro><xacro:m/>",
            "without end",
        ),
        (
            "<xacro:macro name=\"m\" params=\"a\"/><xacro:m/>",
            "needs the parameter `a`",
        ),
        (
            "<xacro:macro name=\"m\"/><xacro:m b=\"1\"/>",
            "no parameter `b`",
        ),
        ("<xacro:if value=\"maybe\"/>", "no truth value"),
        ("<x a=\"${1/0}\"/>", "division by zero"),
        ("<x a=\"${[x for x in y]}\"/>", "for"),
        ("<x a=\"${'a' * 10**9}\"/>", "too long"),
        ("<xacro:element xacro:name=\"\"/>", "no name that XML has"),
        ("<xacro:element name=\"a\"/>", "has no `xacro:name`"),
        (
            "<x><xacro:attribute name=\"a b\" value=\"1\"/></x>",
            "no name that XML has",
        ),
        ("<xacro:macro name=\"a.b\"/>", "cannot be called `a.b`"),
        (
            "<xacro:macro name=\"m\"><xacro:macro name=\"inner\"/></xacro:macro><xacro:m/><xacro:inner/>",
            "no macro `inner`",
        ),
        (
            "<xacro:macro name=\"m\" params=\"a:=${1 b\"/>",
            "not closed",
        ),
        (
            "<xacro:include filename=\"not_there.xacro\"/>",
            "not_there.xacro",
        ),
    ] {
        let said = refused(inside);
        assert!(
            said.contains(wanted) && said.contains("line 2"),
            "{inside}: {said}"
        );
    }
}

#[test]
fn deep_nesting_is_refused_and_not_overrun() {
    let text = format!("<x a=\"${{{}1{}}}\"/>", "(".repeat(400), ")".repeat(400));
    assert!(refused(&text).contains("deeply"));
    let text = format!("{}{}", "<x>".repeat(5000), "</x>".repeat(5000));
    assert!(refused(&text).contains("deeply") || refused(&text).contains("nest"));
    let text = format!("<x a=\"${{{}1}}\"/>", "not ".repeat(100_000));
    assert!(refused(&text).contains("more than"));
}

#[test]
fn a_key_that_stands_twice_has_its_last_value() {
    let text = "link:\n  mass: 1\n  inertia:\n  inertia: {xx: 0.5}\nshared: &all {mass: 2, length: 3}\nother:\n  <<: *all\n  mass: 7\n";
    let read = yaml::read(text).unwrap();
    let at = |path: [&str; 2]| {
        let one = read.get(&path[0].into()).unwrap();
        one.get(&path[1].into()).unwrap().to_string()
    };
    assert_eq!(at(["link", "inertia"]), "{'xx': 0.5}");
    assert_eq!(at(["other", "mass"]), "7");
    assert_eq!(at(["other", "length"]), "3");
}
