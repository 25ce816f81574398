"""What comes in through sections: hydrographs, how deep and fast they flow in, and sections on points."""
