//! Pointers from C, checked: NULL, alignment, size, and what the memory holds. All objects begin with a [`Head`]; their
//! arrays stand behind, each at a multiple of [`SUPPLE_ALIGN`] bytes from the beginning.

use core::ffi::c_void;
use core::{ptr, slice};

use super::SUPPLE_ABI;
use super::status::{Answer, short, supple_error, supple_status};
use supple_status::*;

/// The memory of every object begins at a multiple of so many bytes.
pub const SUPPLE_ALIGN: usize = 64;

/// What the memory of an object begins with.
#[derive(Clone, Copy)]
#[repr(C)]
pub(super) struct Head {
    magic: [u8; 8],
    bytes: usize,
}

impl Head {
    /// Of an object that has more bytes than its own arrays need.
    pub(super) const fn of_bytes(self, bytes: usize) -> Self {
        Self { bytes, ..self }
    }
}

/// An object at the beginning of its memory.
///
/// # Safety
/// The type begins with a [`Head`] (`repr(C)`), and [`Object::MAGIC`] is its own.
pub(super) unsafe trait Object: Sized {
    const MAGIC: [u8; 8];
    /// Bytes before its arrays.
    const FRONT: usize;
    /// A mistake here does not compile.
    const FITS: () = assert!(
        size_of::<Self>() <= Self::FRONT && Self::FRONT % SUPPLE_ALIGN == 0 && align_of::<Self>() <= SUPPLE_ALIGN
    );
}

/// What every magic begins with.
const FAMILY: [u8; 7] = *b"supple:";

/// The magic of a kind.
pub(super) const fn magic(kind: u8) -> [u8; 8] {
    let [a, b, c, d, e, f, g] = FAMILY;
    [a, b, c, d, e, f, g, kind]
}

/// The bytes of an object and of the arrays behind it.
#[derive(Clone, Copy)]
pub(super) struct Layout {
    end: Option<usize>,
}

impl Layout {
    pub(super) const fn of<T: Object>() -> Self {
        let () = T::FITS;
        Self { end: Some(T::FRONT) }
    }

    /// With one more array.
    pub(super) const fn and<T>(self, count: usize) -> Self {
        let Some(end) = self.end else { return self };
        let Some(bytes) = size_of::<T>().checked_mul(count) else { return Self { end: None } };
        let Some(end) = end.checked_add(bytes) else { return Self { end: None } };
        Self { end: end.checked_next_multiple_of(SUPPLE_ALIGN) }
    }

    /// All bytes, zero for more than there can be.
    pub(super) const fn bytes(self) -> usize {
        match self.end {
            Some(end) => end,
            None => 0,
        }
    }
}

/// Memory for an object, checked.
#[derive(Clone, Copy)]
pub(super) struct Place {
    start: *mut u8,
    bytes: usize,
}

impl Place {
    /// # Safety
    /// If not NULL, `memory` is that of `bytes` bytes which nobody else uses meanwhile.
    pub(super) unsafe fn new(memory: *mut c_void, bytes: usize, layout: Layout) -> Answer<Self> {
        let start = memory.cast::<u8>();
        if start.is_null() {
            return Err(SUPPLE_E_NULL.into());
        }
        if start.align_offset(SUPPLE_ALIGN) != 0 {
            return Err(SUPPLE_E_MISALIGNED.into());
        }
        match layout.end {
            Some(needed) if needed <= bytes => Ok(Self { start, bytes: needed }),
            Some(needed) => Err(short(bytes, needed)),
            None => Err(short(bytes, usize::MAX)),
        }
    }

    /// The same place for an object whose last array turned out to be shorter.
    pub(super) fn shrunk(self, layout: Layout) -> Self {
        Self { bytes: self.bytes.min(layout.bytes()), ..self }
    }

    /// The arrays of an object that is not there yet: from now on the memory holds none, until [`Place::put`].
    ///
    /// # Safety
    /// As at `new`. The place's layout began with `T`.
    pub(super) unsafe fn arrays<T: Object>(self) -> Arrays {
        let at = self.start.cast::<T>();
        // SAFETY: there is room for `T::FRONT` bytes, which begin with a head, aligned for it.
        unsafe {
            at.cast::<Head>().write(Head { magic: [0; 8], bytes: self.bytes });
            Arrays::behind(at)
        }
    }

    /// Puts the object there.
    ///
    /// # Safety
    /// As at `arrays`; those that are not any bits have been written.
    pub(super) unsafe fn put<T: Object>(self, object: impl FnOnce(Head) -> T) -> *mut T {
        let at = self.start.cast::<T>();
        // SAFETY: there is room for `T::FRONT` bytes, aligned for it.
        unsafe { at.write(object(self.head::<T>())) };
        at
    }

    /// Where the object will be, for one that is too large to be moved there.
    pub(super) fn object<T: Object>(self) -> *mut T {
        self.start.cast()
    }

    /// What such an object begins with, once the rest of it has been written.
    pub(super) fn head<T: Object>(self) -> Head {
        Head { magic: T::MAGIC, bytes: self.bytes }
    }
}

/// Arrays behind an object, one after the other.
pub(super) struct Arrays {
    at: *mut u8,
    left: usize,
}

impl Arrays {
    /// # Safety
    /// `object` begins with a head, and there are as many bytes as this says.
    pub(super) unsafe fn behind<T: Object>(object: *const T) -> Self {
        // SAFETY: it begins with a head.
        let bytes = unsafe { bytes_of(object) };
        let left = bytes.saturating_sub(T::FRONT);
        // SAFETY: objects have at least so many bytes.
        Self { at: unsafe { object.cast_mut().cast::<u8>().add(T::FRONT) }, left }
    }

    /// The beginning of an array with room for `room` elements, and how many there are: none if there is no such room.
    fn take<T>(&mut self, room: usize) -> (*mut T, usize) {
        let none = (ptr::NonNull::dangling().as_ptr(), 0);
        let Some(bytes) = size_of::<T>().checked_mul(room) else { return none };
        let taken = bytes.next_multiple_of(SUPPLE_ALIGN);
        if taken > self.left || align_of::<T>() > SUPPLE_ALIGN {
            return none;
        }
        let array = self.at.cast();
        self.at = self.at.wrapping_add(taken);
        self.left -= taken;
        (array, room)
    }

    /// An array, to be changed.
    ///
    /// # Safety
    /// Any bits are a `T`, or the array was written before. Nobody else uses it for the time of `'a`.
    pub(super) unsafe fn change<'a, T>(&mut self, count: usize) -> &'a mut [T] {
        // SAFETY: the caller's promise.
        unsafe { self.change_first(count, count) }
    }

    /// The first elements of an array with room for `room`.
    ///
    /// # Safety
    /// As at `change`, for the first `count`.
    pub(super) unsafe fn change_first<'a, T>(&mut self, count: usize, room: usize) -> &'a mut [T] {
        let (first, room) = self.take::<T>(room);
        // SAFETY: within the object's memory, which is aligned, behind the arrays before.
        unsafe { slice::from_raw_parts_mut(first, count.min(room)) }
    }

    /// An array, to be read.
    ///
    /// # Safety
    /// As at `change`, but others may read it.
    pub(super) unsafe fn read<'a, T>(&mut self, count: usize) -> &'a [T] {
        let (first, count) = self.take::<T>(count);
        // SAFETY: as above.
        unsafe { slice::from_raw_parts(first, count) }
    }
}

/// That a pointer leads to an object of the type.
///
/// # Safety
/// If not NULL, it leads to memory that was handed to a function of this library, or has at least the size of a head.
pub(super) unsafe fn is<T: Object>(object: *const T) -> Answer<()> {
    if object.is_null() {
        return Err(SUPPLE_E_NULL.into());
    }
    if object.cast::<u8>().align_offset(SUPPLE_ALIGN) != 0 {
        return Err(SUPPLE_E_MISALIGNED.into());
    }
    // SAFETY: as above.
    match unsafe { (*object.cast::<Head>()).magic } {
        magic if magic == T::MAGIC => Ok(()),
        [a, b, c, d, e, f, g, _] if [a, b, c, d, e, f, g] == FAMILY => Err(SUPPLE_E_KIND.into()),
        _ => Err(SUPPLE_E_NOT_INITIALISED.into()),
    }
}

/// Bytes of an object.
///
/// # Safety
/// It begins with a head.
pub(super) unsafe fn bytes_of<T: Object>(object: *const T) -> usize {
    // SAFETY: the caller's promise.
    unsafe { (*object.cast::<Head>()).bytes }
}

/// An object that is only read.
///
/// # Safety
/// As at [`is`]; nobody writes it meanwhile.
pub(super) unsafe fn read<'a, T: Object>(object: *const T) -> Answer<&'a T> {
    // SAFETY: the caller's promise; and it is an object, once its head says so.
    unsafe { is(object).map(|()| &*object) }
}

/// An object that is changed.
///
/// # Safety
/// As at [`is`]; nobody else uses it meanwhile.
pub(super) unsafe fn change<'a, T: Object>(object: *mut T) -> Answer<&'a mut T> {
    // SAFETY: the caller's promise; and it is an object, once its head says so.
    unsafe { is(object.cast_const()).map(|()| &mut *object) }
}

/// The same with its arrays.
///
/// # Safety
/// As at [`change`].
pub(super) unsafe fn open<'a, T: Object>(object: *mut T) -> Answer<(&'a mut T, Arrays)> {
    // SAFETY: the caller's promise. The head is read before there is a reference that nobody else may read through.
    unsafe {
        is(object.cast_const())?;
        let arrays = Arrays::behind(object.cast_const());
        Ok((&mut *object, arrays))
    }
}

/// An array of the host's, of values or structures. An empty one needs no memory.
///
/// # Safety
/// If not NULL, `first` leads to `count` elements, of which any bits are a `T`, and nobody writes them meanwhile.
pub(super) unsafe fn array<'a, T>(first: *const T, count: usize) -> Answer<&'a [T]> {
    if count == 0 {
        return Ok(&[]);
    }
    if first.is_null() {
        return Err(SUPPLE_E_NULL.into());
    }
    if !first.is_aligned() {
        return Err(SUPPLE_E_MISALIGNED.into());
    }
    match size_of::<T>().checked_mul(count) {
        // SAFETY: the caller's promise.
        Some(bytes) if bytes <= isize::MAX as usize => Ok(unsafe { slice::from_raw_parts(first, count) }),
        _ => Err(short(usize::MAX, count)),
    }
}

/// Bytes that are used where they are: they stay, unchanged, as long as what is made of them.
///
/// # Safety
/// As at [`array()`]; and they do stay.
pub(super) unsafe fn lasting_bytes(first: *const c_void, count: usize) -> Answer<&'static [u8]> {
    if first.is_null() {
        return Err(SUPPLE_E_NULL.into());
    }
    // SAFETY: the caller's promise.
    unsafe { array(first.cast(), count) }
}

/// One structure of the host's.
///
/// # Safety
/// As at [`array()`].
pub(super) unsafe fn one<'a, T>(at: *const T) -> Answer<&'a T> {
    // SAFETY: the caller's promise.
    unsafe { array(at, 1) }?.first().ok_or(SUPPLE_E_NULL.into())
}

/// Memory of the host's for a value or a structure.
///
/// # Safety
/// If not NULL, `at` leads to memory for one.
pub(super) unsafe fn place_for<T>(at: *mut T) -> Answer<*mut T> {
    if at.is_null() {
        return Err(SUPPLE_E_NULL.into());
    }
    if !at.is_aligned() {
        return Err(SUPPLE_E_MISALIGNED.into());
    }
    Ok(at)
}

/// The same for what the host may not want.
///
/// # Safety
/// As at [`place_for`].
pub(super) unsafe fn place_if_wanted<T>(at: *mut T) -> Answer<Option<*mut T>> {
    // SAFETY: the caller's promise.
    if at.is_null() { Ok(None) } else { unsafe { place_for(at) }.map(Some) }
}

/// That a configuration is of this version.
pub(super) fn same_abi<T>(struct_size: u32, abi: u32) -> Answer<()> {
    let wrong = |value: u32, limit: u32| Err(supple_error::from(SUPPLE_E_ABI).value(value.into(), limit.into()));
    if abi != SUPPLE_ABI {
        return wrong(abi, SUPPLE_ABI);
    }
    if struct_size as usize != size_of::<T>() {
        return wrong(struct_size, size_of::<T>() as u32);
    }
    Ok(())
}

/// The status of a call; what went wrong is written to `error`, if that is not NULL.
///
/// # Safety
/// If not NULL, `error` leads to memory for one.
pub(super) unsafe fn answered(answer: Answer<supple_status>, error: *mut supple_error) -> supple_status {
    match answer {
        Ok(status) => status,
        Err(problem) => {
            // SAFETY: the caller's promise.
            if let Ok(error) = unsafe { place_for(error) } {
                // SAFETY: aligned, and there.
                unsafe { error.write(problem) };
            }
            problem.status
        }
    }
}
