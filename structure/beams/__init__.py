"""The beam-spring ring: straight beams on the centre line, joints, soil springs at the nodes."""
