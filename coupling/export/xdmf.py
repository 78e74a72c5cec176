"""XDMF time series of grids that may change from one time to the next: XML beside one HDF5 file.

meshio's own series keeps points and cells fixed, and material points move and leave.
"""

import xml.etree.ElementTree as ET
from pathlib import Path

import h5py
import numpy as np

TOPOLOGIES = {"vertex": "Polyvertex", "triangle": "Triangle", "quad": "Quadrilateral"}
NUMBERS = {"f": "Float", "i": "Int", "u": "UInt"}
KINDS = {1: "Scalar", 3: "Vector", 9: "Tensor"}  # by numbers a place


class XdmfSeries:
    """Writes one grid a time; the XML is complete after leaving the context.

    path : str or path, ends in .xdmf; the HDF5 file beside it ends in .h5.
    """

    def __init__(self, path):
        self.path, self._written = Path(path), {}
        self._root = ET.Element("Xdmf", Version="3.0")
        domain = ET.SubElement(self._root, "Domain")
        self._series = ET.SubElement(domain, "Grid", Name="series", GridType="Collection", CollectionType="Temporal")

    def __enter__(self):
        self._file = h5py.File(self.path.with_suffix(".h5"), "w")
        return self

    def __exit__(self, kind, *_):
        self._file.close()
        if kind is None:
            ET.indent(self._root)
            ET.ElementTree(self._root).write(self.path, encoding="utf-8", xml_declaration=True)

    def append(self, time, mesh):
        """Add one time.

        time : float [s];  mesh : meshio.Mesh, one block of cells of `TOPOLOGIES`; points (n, 3); data are scalars,
        vectors or tensors (n, 9). Arrays that are the same object as at an earlier time are not written again.
        """
        grid = ET.SubElement(self._series, "Grid", Name=f"{time:.6g} s", GridType="Uniform")
        ET.SubElement(grid, "Time", Value=repr(float(time)))
        (block,) = mesh.cells
        topology = ET.SubElement(grid, "Topology", TopologyType=TOPOLOGIES[block.type],
                                 NumberOfElements=str(len(block.data)))  # fmt: skip
        if block.type == "vertex":
            topology.set("NodesPerElement", "1")
        self._item(topology, block.data)
        self._item(ET.SubElement(grid, "Geometry", GeometryType="XYZ"), mesh.points)
        for name, values in mesh.point_data.items():
            self._attribute(grid, name, "Node", values)
        for name, (values,) in mesh.cell_data.items():
            self._attribute(grid, name, "Cell", values)

    def _attribute(self, grid, name, centre, values):
        width = 1 if values.ndim == 1 else values.shape[1]
        self._item(ET.SubElement(grid, "Attribute", Name=name, AttributeType=KINDS[width], Center=centre), values)

    def _item(self, parent, values):
        # keeps a reference, so that an identity is not given to another array
        _, name = self._written.setdefault(id(values), (values, f"data{len(self._written)}"))
        array = np.asarray(values)
        if name not in self._file:
            self._file.create_dataset(name, data=array, compression="gzip", compression_opts=1, shuffle=True)
        kind = {"DataType": NUMBERS[array.dtype.kind], "Precision": str(array.dtype.itemsize)}
        item = ET.SubElement(parent, "DataItem", Format="HDF", Dimensions=" ".join(map(str, array.shape)), **kind)
        item.text = f"{self.path.with_suffix('.h5').name}:/{name}"
