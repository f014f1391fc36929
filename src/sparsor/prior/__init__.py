"""What maps look like: fields, windows, dictionaries, models, the built-in prior."""

from sparsor.prior.field import Field
from sparsor.prior.model import Model, read_model

__all__ = ["Field", "Model", "read_model"]
