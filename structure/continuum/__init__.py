"""The continuum ring: quadrilaterals in plane strain, faces of joints, soil springs at the columns."""
