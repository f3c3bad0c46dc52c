//! Arithmetic on keys: sums, differences, products, quotients and powers of numbers and named values, and comparisons of two.
//!
//! `^` binds before the sign and from the right, as in mathematics. Check: values by hand; every slip is refused with its place.

use std::fmt;

/// An arithmetic expression.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Expression {
    text: String,
    root: Node,
}

#[derive(Debug, Clone, PartialEq)]
enum Node {
    Number(f64),
    Name(String),
    Minus(Box<Node>),
    Two(Box<Node>, char, Box<Node>),
}

/// Deepest nesting of an expression.
const DEEPEST: usize = 100;
/// Most operators of an expression, each of which is a step deeper for those that follow it.
const MOST_OPERATORS: usize = 1000;

impl Expression {
    /// Reads an expression.
    ///
    /// # Errors
    /// What is wrong, and where.
    pub(crate) fn parse(text: &str) -> Result<Self, String> {
        let mut parser = Parser { rest: text, text, depth: 0, operators: 0 };
        let root = parser.sum()?;
        parser.skip();
        if !parser.rest.is_empty() {
            return Err(parser.wrong("an operator, one of + - * / ^"));
        }
        Ok(Self { text: text.trim().into(), root })
    }

    /// The value, with those of its names.
    ///
    /// # Errors
    /// What `value_of` says of a name; a division by zero; numbers that give none. What is missing (NaN) stays so.
    pub(crate) fn value(&self, value_of: &dyn Fn(&str) -> Result<f64, String>) -> Result<f64, String> {
        self.root.value(value_of).map_err(|reason| format!("\"{}\": {reason}", self.text))
    }
}

impl Node {
    fn value(&self, value_of: &dyn Fn(&str) -> Result<f64, String>) -> Result<f64, String> {
        Ok(match self {
            Self::Number(value) => *value,
            Self::Name(name) => value_of(name)?,
            Self::Minus(node) => -node.value(value_of)?,
            Self::Two(left, operator, right) => {
                let (a, b) = (left.value(value_of)?, right.value(value_of)?);
                let value = match operator {
                    '+' => a + b,
                    '-' => a - b,
                    '*' => a * b,
                    '/' if b == 0.0 => return Err("it divides by zero".into()),
                    '/' => a / b,
                    _ => a.powf(b),
                };
                if value.is_nan() && !a.is_nan() && !b.is_nan() {
                    return Err(format!("{a:?} {operator} {b:?} is no number"));
                }
                value
            }
        })
    }
}

struct Parser<'t> {
    rest: &'t str,
    text: &'t str,
    depth: usize,
    operators: usize,
}

impl Parser<'_> {
    fn skip(&mut self) {
        self.rest = self.rest.trim_start();
    }

    /// Takes one of these characters.
    fn take(&mut self, wanted: &[char]) -> Option<char> {
        self.skip();
        let found = self.rest.chars().next().filter(|c| wanted.contains(c))?;
        self.rest = &self.rest[found.len_utf8()..];
        Some(found)
    }

    fn wrong(&self, wanted: &str) -> String {
        let at = self.text.len() - self.rest.len();
        let place = if self.rest.is_empty() { "at its end".to_owned() } else { format!("at \"{}\"", self.rest) };
        format!("\"{}\" cannot be read {place}, character {}: {wanted} is needed", self.text.trim(), at + 1)
    }

    fn chain(&mut self, operators: &[char], part: fn(&mut Self) -> Result<Node, String>) -> Result<Node, String> {
        let mut left = part(self)?;
        while let Some(operator) = self.take(operators) {
            self.operators += 1;
            if self.operators > MOST_OPERATORS {
                return Err(format!("it has more than {MOST_OPERATORS} operators"));
            }
            left = Node::Two(Box::new(left), operator, Box::new(part(self)?));
        }
        Ok(left)
    }

    fn sum(&mut self) -> Result<Node, String> {
        self.chain(&['+', '-'], Self::product)
    }

    fn product(&mut self) -> Result<Node, String> {
        self.chain(&['*', '/'], Self::signed)
    }

    fn signed(&mut self) -> Result<Node, String> {
        self.depth += 1;
        if self.depth > DEEPEST {
            return Err(self.wrong("less nesting"));
        }
        let node = match self.take(&['+', '-']) {
            Some('-') => Node::Minus(Box::new(self.signed()?)),
            Some(_) => self.signed()?,
            None => self.power()?,
        };
        self.depth -= 1;
        Ok(node)
    }

    fn power(&mut self) -> Result<Node, String> {
        let base = self.primary()?;
        Ok(match self.take(&['^']) {
            Some(operator) => Node::Two(Box::new(base), operator, Box::new(self.signed()?)),
            None => base,
        })
    }

    fn primary(&mut self) -> Result<Node, String> {
        if self.take(&['(']).is_some() {
            let inner = self.sum()?;
            return self.take(&[')']).map(|_| inner).ok_or_else(|| self.wrong("a closing bracket"));
        }
        let bytes = self.rest.as_bytes();
        let mut end = 0;
        if bytes.first().is_some_and(|b| b.is_ascii_digit() || *b == b'.') {
            while let Some(b) = bytes.get(end) {
                let exponent = end > 0 && matches!(bytes[end - 1], b'e' | b'E');
                if !(b.is_ascii_digit() || matches!(b, b'.' | b'e' | b'E') || (exponent && matches!(b, b'+' | b'-'))) {
                    break;
                }
                end += 1;
            }
            let number = self.rest[..end].parse().map_err(|_| self.wrong("a number, e.g. 1.5e-6,"))?;
            self.rest = &self.rest[end..];
            return Ok(Node::Number(number));
        }
        while bytes.get(end).is_some_and(|b| b.is_ascii_alphanumeric() || matches!(b, b'_' | b'.')) {
            end += 1;
        }
        if end == 0 {
            return Err(self.wrong("a number, a key or a bracket"));
        }
        let name = self.rest[..end].to_owned();
        self.rest = &self.rest[end..];
        Ok(Node::Name(name))
    }
}

/// A comparison of two expressions.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Condition {
    left: Expression,
    operator: &'static str,
    right: Expression,
}

impl Condition {
    /// Reads `a <= b`, also with `>=`, `<` and `>`.
    ///
    /// # Errors
    /// No comparison, or sides that are no expressions.
    pub(crate) fn parse(text: &str) -> Result<Self, String> {
        let operators = ["<=", ">=", "<", ">"];
        let found = operators.into_iter().find_map(|operator| Some((operator, text.split_once(operator)?)));
        let (operator, (left, right)) =
            found.ok_or_else(|| format!("\"{text}\" is no comparison: two expressions with <=, >=, < or > between"))?;
        Ok(Self { left: Expression::parse(left)?, operator, right: Expression::parse(right)? })
    }

    /// Whether it holds; false where a side is no number.
    ///
    /// # Errors
    /// As [`Expression::value`].
    pub(crate) fn holds(&self, value_of: &dyn Fn(&str) -> Result<f64, String>) -> Result<bool, String> {
        let (left, right) = (self.left.value(value_of)?, self.right.value(value_of)?);
        Ok(match self.operator {
            "<=" => left <= right,
            ">=" => left >= right,
            "<" => left < right,
            _ => left > right,
        })
    }
}

impl fmt::Display for Expression {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(&self.text)
    }
}

impl fmt::Display for Condition {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{} {} {}", self.left, self.operator, self.right)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn keys(name: &str) -> Result<f64, String> {
        match name {
            "laser.prf_hz" => Ok(400.0),
            "zero" => Ok(0.0),
            _ => Err(format!("{name} is unknown")),
        }
    }

    fn value(text: &str) -> Result<f64, String> {
        Expression::parse(text)?.value(&keys)
    }

    #[test]
    fn values_are_those_of_arithmetic() {
        for (text, expected) in [
            ("0.06/laser.prf_hz", 0.06 / 400.0),
            ("1 + 2*3", 7.0),
            ("(1+2) * 3", 9.0),
            ("2^3^2", 512.0),
            ("-2^2", -4.0),
            ("2^-1", 0.5),
            ("1 - 2 - 3", -4.0),
            ("8/4/2", 1.0),
            ("1.5e-6 - -1E+1", 1.5e-6 + 10.0),
            (".5*zero", 0.0),
        ] {
            assert_eq!(value(text), Ok(expected), "{text}");
        }
    }

    #[test]
    fn slips_are_refused_with_their_place() {
        for (text, wanted) in [
            ("1/zero", "divides by zero"),
            ("1/(laser.prf_hz - 400)", "divides by zero"),
            ("1 +", "at its end"),
            ("(1", "a closing bracket"),
            ("1 2", "an operator"),
            ("2 $ 3", "at \"$ 3\", character 3"),
            ("1.2.3", "a number, e.g."),
            ("colour*2", "colour is unknown"),
            ("", "at its end"),
            ("(0-1)^0.5", "is no number"),
        ] {
            let message = value(text).unwrap_err();
            assert!(message.contains(wanted), "{text}: {message}");
        }
        assert!(value(&"(".repeat(100_000)).unwrap_err().contains("less nesting"));
        for operator in ["+", "*"] {
            let long = |terms: usize| value(&vec!["1"; terms].join(operator));
            assert!(long(1001).is_ok());
            assert!(long(100_000).unwrap_err().contains("more than 1000 operators"), "{operator}");
        }
    }

    #[test]
    fn comparisons_hold_or_not() {
        let holds = |text: &str| Condition::parse(text).and_then(|c| c.holds(&keys));
        assert_eq!(holds("laser.prf_hz * 2 <= 800"), Ok(true));
        assert_eq!(holds("laser.prf_hz < 400"), Ok(false));
        assert_eq!(holds("laser.prf_hz >= 400"), Ok(true));
        assert_eq!(holds("1 > 2"), Ok(false));
        assert!(holds("laser.prf_hz").unwrap_err().contains("no comparison"));
    }
}
