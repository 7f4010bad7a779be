/* One call of the kernel from Python, as cheap as a call can be: `Call(owner, render, render_held,
   render_on, texture, state, single)` holds addresses of the kernel's functions and of what they work on,
   and its method `render(speed, force, samples, out)` renders; speed and force are None for the hand as
   last read. It takes what needs no conversion and answers None to anything else;
   tactileq.modeling.rendering.renderer converts and refuses.

   Only Python's stable interface is used (setup.py defines Py_LIMITED_API): one build serves all versions.

   Copyright (C) 2026 the tactileq authors. SPDX-License-Identifier: GPL-3.0-or-later */

#define PY_SSIZE_T_CLEAN
#define NPY_NO_DEPRECATED_API NPY_1_7_API_VERSION
#include <Python.h>
#include <stddef.h>
#include <structmember.h>

#include <numpy/arrayobject.h>

#define CHUNK 256 /* samples that are converted from one precision to the other at a time */
#define WORTH_RELEASING 512     /* samples from which on other threads of Python may run meanwhile */
#define MOST_SAMPLES 2147483648 /* MOST_SAMPLES of tactileq.modeling.rendering.renderer */

typedef void render_call(const void *texture, void *state, const void *speed, const void *force,
                         void *out, size_t count);
typedef void held_double(const void *texture, void *state, double speed, double force, void *out,
                         size_t count);
typedef void held_single(const void *texture, void *state, float speed, float force, void *out,
                         size_t count);

typedef void on_call(const void *texture, void *state, void *out, size_t count);

typedef struct {
    PyObject_HEAD
    PyObject *owner; /* of texture and state */
    uintptr_t render, held, on;
    void *texture, *state;
    int single;
    int busy; /* rendering, perhaps while other threads of Python run */
} Call;

/* A hand: an array of doubles each, or two numbers where the arrays are NULL, or as last read. */
typedef struct {
    const double *speeds, *forces;
    double speed, force;
    int read;
} Hand;

static void in_kernel_precision(const Call *c, const Hand *hand, size_t from, void *out, size_t count)
{
    float speeds[CHUNK], forces[CHUNK];
    size_t n;
    if (hand->read)
        ((on_call *)c->on)(c->texture, c->state, out, count);
    else if (!hand->speeds && c->single)
        ((held_single *)c->held)(c->texture, c->state, (float)hand->speed, (float)hand->force, out,
                                 count);
    else if (!hand->speeds)
        ((held_double *)c->held)(c->texture, c->state, hand->speed, hand->force, out, count);
    else if (!c->single)
        ((render_call *)c->render)(c->texture, c->state, hand->speeds + from, hand->forces + from, out,
                                   count);
    else { /* at most CHUNK samples */
        for (n = 0; n < count; n++) {
            speeds[n] = (float)hand->speeds[from + n];
            forces[n] = (float)hand->forces[from + n];
        }
        ((render_call *)c->render)(c->texture, c->state, speeds, forces, out, count);
    }
}

static void render(const Call *c, const Hand *hand, void *out, int out_single, size_t count)
{
    size_t done = 0, n, piece;
    if (out_single == c->single && !(c->single && hand->speeds)) {
        in_kernel_precision(c, hand, 0, out, count);
        return;
    }
    for (; done < count; done += piece) {
        union {
            double doubles[CHUNK];
            float floats[CHUNK];
        } rendered;
        piece = count - done < CHUNK ? count - done : CHUNK;
        in_kernel_precision(c, hand, done, &rendered, piece);
        for (n = 0; n < piece; n++)
            if (out_single)
                ((float *)out)[done + n] = c->single ? rendered.floats[n] : (float)rendered.doubles[n];
            else
                ((double *)out)[done + n] = c->single ? rendered.floats[n] : rendered.doubles[n];
    }
}

/* A vector as it lies in memory, of this type, or NULL. */
static PyArrayObject *vector(PyObject *object, int type, int flags)
{
    PyArrayObject *array = (PyArrayObject *)object;
    int fits = PyArray_CheckExact(object) && PyArray_NDIM(array) == 1 && PyArray_TYPE(array) == type &&
               PyArray_CHKFLAGS(array, flags) && PyArray_ISNOTSWAPPED(array);
    return fits ? array : NULL;
}

/* 1 where both are arrays of doubles of one length, both numbers or both None; else 0. The length of arrays. */
static int hand_of(PyObject *speed, PyObject *force, Hand *hand, Py_ssize_t *length)
{
    PyArrayObject *speeds = vector(speed, NPY_DOUBLE, NPY_ARRAY_CARRAY_RO);
    PyArrayObject *forces = vector(force, NPY_DOUBLE, NPY_ARRAY_CARRAY_RO);
    hand->speeds = hand->forces = NULL;
    hand->speed = hand->force = 0;
    hand->read = speed == Py_None && force == Py_None;
    *length = -1;
    if (hand->read)
        return 1;
    if (speeds && forces && PyArray_DIM(speeds, 0) == PyArray_DIM(forces, 0)) {
        *length = PyArray_DIM(speeds, 0);
        hand->speeds = PyArray_DATA(speeds);
        hand->forces = PyArray_DATA(forces);
        return 1;
    }
    if (!PyFloat_Check(speed) || !PyFloat_Check(force))
        return 0;
    hand->speed = PyFloat_AsDouble(speed);
    hand->force = PyFloat_AsDouble(force);
    return 1;
}

/* Whether rendering into `out` would overwrite a hand that is still to be read. */
static int overlaps(const Hand *hand, size_t length, PyArrayObject *out)
{
    uintptr_t start = (uintptr_t)PyArray_DATA(out), end = start + (size_t)PyArray_NBYTES(out);
    uintptr_t speeds = (uintptr_t)hand->speeds, forces = (uintptr_t)hand->forces;
    size_t size = length * sizeof(double);
    return hand->speeds && ((speeds < end && start < speeds + size) ||
                            (forces < end && start < forces + size));
}

static PyObject *called(PyObject *self, PyObject *const *arguments, Py_ssize_t given)
{
    Call *c = (Call *)self;
    PyObject *samples, *out;
    PyArrayObject *array = NULL;
    Py_ssize_t count, wanted = -1;
    Hand hand;
    if (given != 4) {
        PyErr_SetString(PyExc_TypeError, "expected speed, force, samples and out, and nothing else");
        return NULL;
    }
    samples = arguments[2], out = arguments[3];
    if (!hand_of(arguments[0], arguments[1], &hand, &count))
        Py_RETURN_NONE;
    if (samples != Py_None) {
        if (!PyLong_CheckExact(samples))
            Py_RETURN_NONE;
        wanted = PyLong_AsSsize_t(samples);
        if (wanted < 0 || wanted > MOST_SAMPLES) {
            PyErr_Clear();
            Py_RETURN_NONE;
        }
    }
    if (out != Py_None) {
        array = vector(out, NPY_DOUBLE, NPY_ARRAY_CARRAY);
        if (!array)
            array = vector(out, NPY_FLOAT, NPY_ARRAY_CARRAY);
        if (!array || (wanted >= 0 && wanted != PyArray_DIM(array, 0)))
            Py_RETURN_NONE;
        wanted = PyArray_DIM(array, 0);
    }
    if (hand.speeds ? (samples != Py_None || (wanted >= 0 && wanted != count)) : wanted < 0)
        Py_RETURN_NONE;
    if (!hand.speeds)
        count = wanted;
    if (array && overlaps(&hand, (size_t)count, array))
        Py_RETURN_NONE;
    if (c->busy) {
        PyErr_SetString(PyExc_RuntimeError,
                        "expected one call of a renderer at a time, got two from different threads; "
                        "make a renderer for each thread.");
        return NULL;
    }
    if (array)
        Py_INCREF(out);
    else {
        npy_intp shape = count;
        out = PyArray_EMPTY(1, &shape, NPY_DOUBLE, 0);
        if (!out)
            return NULL;
        array = (PyArrayObject *)out;
    }
    if (count >= WORTH_RELEASING) {
        c->busy = 1;
        Py_BEGIN_ALLOW_THREADS
        render(c, &hand, PyArray_DATA(array), PyArray_TYPE(array) == NPY_FLOAT, (size_t)count);
        Py_END_ALLOW_THREADS
        c->busy = 0;
    } else
        render(c, &hand, PyArray_DATA(array), PyArray_TYPE(array) == NPY_FLOAT, (size_t)count);
    return out;
}

static PyObject *new_call(PyTypeObject *type, PyObject *arguments, PyObject *names)
{
    unsigned long long render, held, on, texture, state;
    PyObject *owner;
    int single;
    Call *c;
    (void)names;
    if (!PyArg_ParseTuple(arguments, "OKKKKKp", &owner, &render, &held, &on, &texture, &state, &single))
        return NULL;
    c = (Call *)((allocfunc)PyType_GetSlot(type, Py_tp_alloc))(type, 0);
    if (!c)
        return NULL;
    Py_INCREF(owner);
    c->owner = owner;
    c->render = (uintptr_t)render;
    c->held = (uintptr_t)held;
    c->on = (uintptr_t)on;
    c->texture = (void *)(uintptr_t)texture;
    c->state = (void *)(uintptr_t)state;
    c->single = single;
    return (PyObject *)c;
}

static void delete_call(PyObject *self)
{
    PyTypeObject *type = Py_TYPE(self);
    Py_XDECREF(((Call *)self)->owner);
    ((freefunc)PyType_GetSlot(type, Py_tp_free))(self);
    Py_DECREF(type); /* each of its objects holds it */
}

static PyMethodDef methods[] = {
    {"render", (PyCFunction)(void (*)(void))called, METH_FASTCALL, "the next samples"},
    {NULL, NULL, 0, NULL},
};

static PyMemberDef members[] = {
    {"busy", T_INT, offsetof(Call, busy), READONLY, "whether it renders, in another thread"},
    {NULL, 0, 0, 0, NULL},
};

static PyType_Slot slots[] = {
    {Py_tp_new, (void *)new_call},
    {Py_tp_dealloc, (void *)delete_call},
    {Py_tp_methods, methods},
    {Py_tp_members, members},
    {0, NULL},
};

static PyType_Spec call_type = {
    .name = "tactileq.modeling.rendering._call.Call",
    .basicsize = sizeof(Call),
    .flags = Py_TPFLAGS_DEFAULT,
    .slots = slots,
};

static struct PyModuleDef module = {PyModuleDef_HEAD_INIT, .m_name = "_call", .m_size = -1};

PyMODINIT_FUNC PyInit__call(void)
{
    PyObject *made, *type;
    import_array();
    type = PyType_FromSpec(&call_type);
    if (!type)
        return NULL;
    made = PyModule_Create(&module);
    if (made && PyModule_AddObjectRef(made, "Call", type) < 0)
        Py_CLEAR(made);
    Py_DECREF(type);
    return made;
}
