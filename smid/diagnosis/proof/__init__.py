"""What is proven of a diagnosis: windows, the decision of one model, and the statement about all of them."""
