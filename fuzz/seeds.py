"""Small FCLIB files in many layouts of HDF5, for the fuzzer to start from: python3 seeds.py FOLDER (needs h5py)."""
import os
import sys

import h5py
import numpy as np

folder = sys.argv[1]
number = 1000


def make(version, fill, **data):
    """One contact in the plane, W as triplets of layout `data`; `fill` changes the file further."""
    global number
    path = os.path.join(folder, str(number))
    number += 1
    try:
        with h5py.File(path, "w", libver=(version, "latest")) as f:
            g = f.create_group("fclib_local")
            g["spacedim"] = np.array([2], "i4")
            W = g.create_group("W")
            for name, value in dict(m=2, n=2, nz=3).items():
                W[name] = np.array([value], "i4")
            for name in "pi":
                W.create_dataset(name, data=np.array([0, 1, 1], "i4"), **data)
            W.create_dataset("x", data=np.array([2.0, 3.0, 0.5]), **data)
            g["vectors/q"] = np.array([-1.0, 0.5], "f2")
            g["vectors/mu"] = np.array([0.5], ">f4")
            fill(f, g, W)
    except ValueError as refused:
        # Old versions of the library lack some layouts.
        print(version, data, refused)
        os.remove(path)


def nothing(f, g, W):
    pass


def soft(f, g, W):
    f.move("fclib_local/W/p", "elsewhere")
    W["p"] = h5py.SoftLink("/elsewhere")
    W["other"] = h5py.SoftLink("other")


def texts(f, g, W):
    g["info/title"] = "a seed"
    g["info"].attrs["numberOfDegreeOfFreedom"] = np.array([3], "i4")


def crowded(f, g, W):
    for k in range(12):
        W[f"more{k}"] = h5py.SoftLink("x")
        W.attrs[f"more{k}"] = k


def plane(f, g, W):
    x = W["x"][()]
    del W["x"]
    W.create_dataset("x", data=x.reshape(1, 3), chunks=(1, 2), maxshape=(None, None), compression="gzip")


def committed(f, g, W):
    f["kind"] = np.dtype("f8")
    x = W["x"][()]
    del W["x"]
    W.create_dataset("x", data=x, dtype=f["kind"])


def early(f, g, W):
    del W["x"]
    dcpl = h5py.h5p.create(h5py.h5p.DATASET_CREATE)
    dcpl.set_chunk((2,))
    dcpl.set_alloc_time(h5py.h5d.ALLOC_TIME_EARLY)
    d = h5py.h5d.create(W.id, b"x", h5py.h5t.IEEE_F64LE, h5py.h5s.create_simple((3,)), dcpl=dcpl)
    d.write(h5py.h5s.ALL, h5py.h5s.ALL, np.array([2.0, 3.0, 0.5]))


def points(f, g, W):
    for k in ["solution", "guesses/1"]:
        f[f"{k}/u"] = np.zeros(2)
        f[f"{k}/r"] = np.ones(2)
    f["guesses/number_of_guesses"] = np.array([1], "i4")


def many(f, g, W):
    """Enough chunks for pages of indices and secondary blocks."""
    del W["x"]
    W.create_dataset("x", shape=(40000,), dtype="f8", chunks=(1,), maxshape=(None,))[:3] = 1.0
    W["x"][200] = W["x"][39000] = 0.0
    del W["p"]
    W.create_dataset("p", shape=(4000,), dtype="i4", chunks=(1,))[:3] = [0, 1, 1]


for version in ["earliest", "v108", "v110", "v200"]:
    for fill in [nothing, soft, texts, crowded, plane, committed, early, points, many]:
        make(version, fill)
    make(version, nothing, chunks=(3,), compression="gzip")
    make(version, nothing, chunks=(2,), compression="gzip", shuffle=True, fletcher32=True)
    make(version, nothing, chunks=(2,), maxshape=(None,), compression="lzf")
    make(version, nothing, chunks=(2,), maxshape=(None,))
    make(version, nothing, chunks=(1,), maxshape=(9,))

    def scaled(f, g, W):
        for name in "px":
            values = W[name][()]
            del W[name]
            W.create_dataset(name, data=values, chunks=(2,), scaleoffset=0 if name == "p" else 1)

    make(version, scaled)
