"""Methods: where an asset's physics come from. The paper's others are the laboratory's."""
