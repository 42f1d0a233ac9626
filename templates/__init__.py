"""Jinja templates that arrange generated expressions; they contain no algorithm."""

import jinja2


def environment() -> jinja2.Environment:
    """What reads the templates: an unknown name is an error, lines of tags leave no blank ones."""
    return jinja2.Environment(
        loader=jinja2.PackageLoader("signorini.templates", ""),
        undefined=jinja2.StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
        keep_trailing_newline=True,
        autoescape=False,
    )
