DIGEST: str
EVALUATION_METHOD: int

def less_product(c: float, a: float, b: float) -> float: ...
