"""What is wrong with a document, by its JSON schema, in words for the person who gave it."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from jsonschema import Draft202012Validator, ValidationError
from jsonschema.exceptions import relevance

from motiongen.suggestions import did_you_mean

KINDS = {
    "object": "a set of fields",
    "array": "a list",
    "string": "text",
    "number": "a number",
    "integer": "a whole number",
    "boolean": "true or false",
    "null": "nothing",
}


def problem_in(content: Any, schema: Mapping[str, Any]) -> str | None:
    """The foremost problem, beginning with the field; None for a document of the form that the schema describes."""
    problems = sorted(Draft202012Validator(schema).iter_errors(content), key=relevance)
    return _reworded(problems[-1]) if problems else None


def _reworded(error: ValidationError) -> str:
    field = f"{error.json_path.removeprefix('$').removeprefix('.') or 'document':.200}"
    value, limit = error.instance, error.validator_value
    match error.validator:
        case "additionalProperties":
            known = error.schema["properties"]
            unknown = next(key for key in value if key not in known)
            near = did_you_mean(str(unknown), known)
            return f"{field}: has no field {unknown!r:.200}{near}\n  fields: {', '.join(known)}"
        case "required":
            missing = next(name for name in limit if name not in value)
            return f"{field}: the field {missing!r} is missing"
        case "type":
            kinds = [limit] if isinstance(limit, str) else limit
            return f"{field}: {value!r:.60} is not {' or '.join(KINDS[kind] for kind in kinds)}"
        case "exclusiveMinimum" | "minimum":
            return f"{field}: {value!s:.60} is not {'above' if error.validator[0] == 'e' else 'at least'} {limit}"
        case "maximum":
            return f"{field}: {value!s:.60} is more than {limit}"
        case "minItems" | "minLength":
            return f"{field}: needs at least {limit}, and has {len(value)}"
        case "maxItems":
            return f"{field}: takes at most {limit}, and has {len(value)}"
    return f"{field}: {error.message:.500}"
