-- SPDX-License-Identifier: Apache-2.0
-- Version 1 of the hub's tables. Never edit it: a change of the tables is a new version with a script of its own.
--
-- Nobody but the owner writes to a table. Curators write through functions that check role, revision, policy and
-- content and add to the log of changes, so that a hand-written client is bound in the same way as Docent itself.
-- Error codes: DC001 the revision is not the newest, DC002 the policy forbids it, DC003 the role forbids it,
-- DC004 a value is not valid, DC005 there is no such thing.

DO $$
BEGIN
  -- Roles belong to the server, on which there may be several hubs.
  IF NOT EXISTS (SELECT FROM pg_roles WHERE rolname = 'docent_visitor') THEN CREATE ROLE docent_visitor NOLOGIN; END IF;
  IF NOT EXISTS (SELECT FROM pg_roles WHERE rolname = 'docent_curator') THEN CREATE ROLE docent_curator NOLOGIN; END IF;
  IF NOT EXISTS (SELECT FROM pg_roles WHERE rolname = 'docent_admin') THEN CREATE ROLE docent_admin NOLOGIN; END IF;
  GRANT docent_visitor TO docent_curator;
  GRANT docent_curator TO docent_admin;
  EXECUTE format('REVOKE ALL ON DATABASE %I FROM PUBLIC', current_database());
  EXECUTE format('GRANT CONNECT ON DATABASE %I TO docent_visitor', current_database());
END $$;

CREATE SCHEMA docent;

CREATE TABLE docent.hub (
  only_one boolean PRIMARY KEY DEFAULT true CHECK (only_one),
  id uuid NOT NULL DEFAULT gen_random_uuid(),
  version integer NOT NULL,
  last_change bigint NOT NULL DEFAULT 0,
  kept_revisions integer NOT NULL DEFAULT 50 CHECK (kept_revisions BETWEEN 2 AND 10000)
);
INSERT INTO docent.hub (version) VALUES (1);

-- The users whom add_user made; others are never removed or given a password here.
CREATE TABLE docent.users (name text PRIMARY KEY);

-- A map. `number` is the key under which signposts of other maps lead to it: the first 63 bits of its id.
CREATE TABLE docent.maps (
  id uuid PRIMARY KEY,
  number bigint NOT NULL UNIQUE CHECK (number > 0),
  revision bigint NOT NULL,
  change bigint NOT NULL UNIQUE,
  name text NOT NULL,
  removed boolean NOT NULL
);
CREATE UNIQUE INDEX maps_name ON docent.maps (name) WHERE NOT removed;

-- A state of a map. Revisions are never changed, and the newest kept_revisions of each map are kept.
CREATE TABLE docent.revisions (
  map uuid NOT NULL REFERENCES docent.maps DEFERRABLE INITIALLY DEFERRED,
  revision bigint NOT NULL CHECK (revision > 0),
  structure_revision bigint NOT NULL,
  scene_revision bigint NOT NULL,
  name text NOT NULL CHECK (octet_length(name) BETWEEN 1 AND 200 AND name !~ '[\x01-\x1f\x7f]'),
  policy text NOT NULL CHECK (policy IN ('open', 'bounded', 'augment-only', 'read-only')),
  bounds double precision[] CHECK (bounds IS NULL OR (array_length(bounds, 1) = 6 AND array_position(bounds, NULL) IS NULL
    AND bounds[1] <= bounds[4] AND bounds[2] <= bounds[5] AND bounds[3] <= bounds[6]
    AND NOT 'NaN' = ANY (bounds) AND NOT 'Infinity' = ANY (bounds) AND NOT '-Infinity' = ANY (bounds))),
  created_ns bigint NOT NULL,
  modified_ns bigint NOT NULL,
  map_revision bigint NOT NULL CHECK (map_revision >= 0),
  next_keyframe bigint NOT NULL CHECK (next_keyframe BETWEEN 0 AND 4294967295),
  next_point bigint NOT NULL CHECK (next_point BETWEEN 0 AND 4294967295),
  keyframes bigint NOT NULL CHECK (keyframes BETWEEN 0 AND 4294967295),
  points bigint NOT NULL CHECK (points BETWEEN 0 AND 4294967295),
  observations bigint NOT NULL CHECK (observations >= 0),
  asset_names jsonb NOT NULL CHECK (jsonb_typeof(asset_names) = 'object'),
  removed boolean NOT NULL,
  written_by text NOT NULL,
  written_at timestamptz NOT NULL,
  PRIMARY KEY (map, revision),
  CHECK (policy <> 'bounded' OR bounds IS NOT NULL)
);

-- Bytes under their hash, so that revisions share what they have in common.
CREATE TABLE docent.blobs (
  hash text PRIMARY KEY CHECK (hash = encode(sha256(data), 'hex')),
  data bytea NOT NULL CHECK (octet_length(data) <= 536870912),
  used_at timestamptz NOT NULL
);
-- Images are compressed already, and a part of a value that is not compressed can be read by itself.
ALTER TABLE docent.blobs ALTER COLUMN data SET STORAGE EXTERNAL;

-- What a revision consists of: the binary columns of the map, its scene, images and assets.
CREATE TABLE docent.items (
  map uuid NOT NULL,
  revision bigint NOT NULL,
  item text NOT NULL CHECK (item ~ ('^(cameras|keyframes|points|observations|panoramas|thumbnails|words|mesh|scene'
    || '|image/(0|[1-9][0-9]{0,9})|asset/[!-~]{4,128})$')),
  blob text NOT NULL REFERENCES docent.blobs,
  PRIMARY KEY (map, revision, item),
  FOREIGN KEY (map, revision) REFERENCES docent.revisions ON DELETE CASCADE
);
CREATE INDEX items_blob ON docent.items (blob);

CREATE TABLE docent.tours (
  name text PRIMARY KEY CHECK (octet_length(name) BETWEEN 1 AND 200 AND name !~ '[\x01-\x1f\x7f]'),
  revision bigint NOT NULL,
  change bigint NOT NULL UNIQUE,
  language text NOT NULL CHECK (language ~ '^([A-Za-z0-9]{1,8}(-[A-Za-z0-9]{1,8}){0,8})?$'),
  minutes integer NOT NULL CHECK (minutes BETWEEN 0 AND 1440),
  stops uuid[] NOT NULL CHECK (cardinality(stops) <= 1000),
  removed boolean NOT NULL
);

CREATE TABLE docent.changes (
  change bigint PRIMARY KEY,
  made_at timestamptz NOT NULL,
  made_by text NOT NULL,
  what text NOT NULL,
  map uuid,
  revision bigint,
  subject text NOT NULL
);

CREATE FUNCTION docent.refuse_change() RETURNS trigger LANGUAGE plpgsql AS $$
BEGIN
  RAISE EXCEPTION 'the log and the revisions of a hub are never changed' USING ERRCODE = 'DC003';
END $$;
CREATE TRIGGER changes_stay BEFORE UPDATE OR DELETE OR TRUNCATE ON docent.changes
  FOR EACH STATEMENT EXECUTE FUNCTION docent.refuse_change();
CREATE TRIGGER revisions_stay BEFORE UPDATE OR TRUNCATE ON docent.revisions
  FOR EACH STATEMENT EXECUTE FUNCTION docent.refuse_change();
CREATE TRIGGER items_stay BEFORE UPDATE OR TRUNCATE ON docent.items
  FOR EACH STATEMENT EXECUTE FUNCTION docent.refuse_change();

-- session_user is who logged in: neither SET ROLE nor a function that runs as its owner changes it.
CREATE FUNCTION docent.require(wanted text) RETURNS void LANGUAGE plpgsql STABLE AS $$
BEGIN
  IF NOT pg_has_role(session_user, 'docent_' || wanted, 'USAGE') THEN
    RAISE EXCEPTION 'the user ''%'' is no % of this hub', session_user, wanted USING ERRCODE = 'DC003';
  END IF;
END $$;

-- Numbers the change, logs it, and tells who listens when the transaction is committed. The row of `hub` stays locked
-- until then, so that changes get their numbers in the order in which they become visible.
CREATE FUNCTION docent.log_change(done text, of_map uuid, to_revision bigint, of_subject text) RETURNS bigint
LANGUAGE plpgsql AS $$
DECLARE
  number bigint;
BEGIN
  UPDATE docent.hub SET last_change = last_change + 1 RETURNING last_change INTO number;
  INSERT INTO docent.changes VALUES (number, clock_timestamp(), session_user, done, of_map, to_revision, of_subject);
  PERFORM pg_notify('docent_changes', number::text);
  RETURN number;
END $$;

CREATE FUNCTION docent.number_of(id uuid) RETURNS bigint IMMUTABLE LANGUAGE sql AS
  $$ SELECT ('x' || left(replace(id::text, '-', ''), 16))::bit(64)::bigint & 9223372036854775807 $$;

-- How strict a policy is.
CREATE FUNCTION docent.strictness(policy text) RETURNS integer IMMUTABLE LANGUAGE sql AS
  $$ SELECT array_position(ARRAY['open', 'bounded', 'augment-only', 'read-only'], policy) $$;

-- A little-endian number of 8 bytes (IEEE 754). Infinite numbers and those that are no number are refused.
CREATE FUNCTION docent.double_at(bytes bytea, first integer) RETURNS double precision IMMUTABLE LANGUAGE plpgsql AS $$
DECLARE
  exponent integer := (get_byte(bytes, first + 7) & 127) * 16 + get_byte(bytes, first + 6) / 16;
  mantissa double precision := get_byte(bytes, first + 6) & 15;
  value double precision;
BEGIN
  FOR i IN REVERSE 5..0 LOOP
    mantissa := mantissa * 256 + get_byte(bytes, first + i);
  END LOOP;
  IF exponent = 2047 THEN
    RAISE EXCEPTION 'a keyframe has a pose that is not a number' USING ERRCODE = 'DC004';
  END IF;
  IF exponent < 23 THEN  -- Below 1e-300, which is nothing in any map.
    RETURN 0;
  END IF;
  value := (1 + mantissa / 4503599627370496.0::double precision) * power(2::double precision, exponent - 1023);
  RETURN CASE WHEN get_byte(bytes, first + 7) >= 128 THEN -value ELSE value END;
END $$;

-- The number of records in a binary column of this kind; see maps/README.md for the layout.
CREATE FUNCTION docent.count_in(bytes bytea, magic text, record_bytes integer) RETURNS bigint
LANGUAGE plpgsql IMMUTABLE AS $$
DECLARE
  counted bigint := 0;
BEGIN
  IF octet_length(bytes) < 32 OR substr(bytes, 1, 4) <> convert_to(magic, 'UTF8') THEN
    RAISE EXCEPTION 'a column of the map is not of its kind' USING ERRCODE = 'DC004';
  END IF;
  FOR i IN REVERSE 19..16 LOOP
    counted := counted * 256 + get_byte(bytes, i);
  END LOOP;
  IF octet_length(bytes) <> 32 + counted * record_bytes THEN
    RAISE EXCEPTION 'a column of the map has another size than its number of records' USING ERRCODE = 'DC004';
  END IF;
  RETURN counted;
END $$;

-- The keyframes of a revision with the centres of their cameras.
CREATE FUNCTION docent.keyframes_of(of_map uuid, of_revision bigint)
RETURNS TABLE (keyframe bigint, x double precision, y double precision, z double precision)
LANGUAGE plpgsql STABLE AS $$
DECLARE
  bytes bytea;
  entry bytea;
  q double precision[];
  t double precision[];
  c double precision[];
BEGIN
  SELECT b.data INTO bytes FROM docent.items i JOIN docent.blobs b ON b.hash = i.blob
    WHERE i.map = of_map AND i.revision = of_revision AND i.item = 'keyframes';
  FOR n IN 1..docent.count_in(bytes, 'DKFR', 98) LOOP
    entry := substr(bytes, 25 + 98 * (n - 1)::integer, 98);
    keyframe := get_byte(entry, 0) + 256 * (get_byte(entry, 1) + 256 * (get_byte(entry, 2) + 256 * get_byte(entry, 3)::bigint));
    q := ARRAY[-docent.double_at(entry, 18), -docent.double_at(entry, 26), -docent.double_at(entry, 34),
               docent.double_at(entry, 42)];
    t := ARRAY[docent.double_at(entry, 50), docent.double_at(entry, 58), docent.double_at(entry, 66)];
    IF abs(q[1] * q[1] + q[2] * q[2] + q[3] * q[3] + q[4] * q[4] - 1) > 1e-5 THEN
      RAISE EXCEPTION 'a keyframe has no valid rotation' USING ERRCODE = 'DC004';
    END IF;
    -- The centre is -R^T t. With u, the vector of the inverse rotation, R^T t = t + 2 w (u x t) + 2 u x (u x t).
    c := ARRAY[q[2] * t[3] - q[3] * t[2], q[3] * t[1] - q[1] * t[3], q[1] * t[2] - q[2] * t[1]];
    x := -(t[1] + 2 * q[4] * c[1] + 2 * (q[2] * c[3] - q[3] * c[2]));
    y := -(t[2] + 2 * q[4] * c[2] + 2 * (q[3] * c[1] - q[1] * c[3]));
    z := -(t[3] + 2 * q[4] * c[3] + 2 * (q[1] * c[2] - q[2] * c[1]));
    RETURN NEXT;
  END LOOP;
END $$;

-- Refuses a revision whose parts do not fit each other.
CREATE FUNCTION docent.check_parts(of_map uuid, of_revision bigint) RETURNS void LANGUAGE plpgsql AS $$
DECLARE
  new docent.revisions;
  counted record;
BEGIN
  SELECT * INTO new FROM docent.revisions WHERE map = of_map AND revision = of_revision;
  SELECT count(*) AS required INTO counted FROM docent.items WHERE map = of_map AND revision = of_revision
    AND item IN ('cameras', 'keyframes', 'points', 'observations', 'panoramas', 'thumbnails', 'words', 'scene');
  IF counted.required <> 8 THEN
    RAISE EXCEPTION 'a part of the map is missing' USING ERRCODE = 'DC004';
  END IF;
  FOR counted IN
    SELECT docent.count_in(b.data, kind.magic, kind.size) AS there, kind.stated
    FROM (VALUES ('keyframes', 'DKFR', 98, new.keyframes), ('points', 'DPNT', 61, new.points),
                 ('observations', 'DOBS', 17, new.observations)) AS kind (item, magic, size, stated)
    JOIN docent.items i ON i.map = of_map AND i.revision = of_revision AND i.item = kind.item
    JOIN docent.blobs b ON b.hash = i.blob
  LOOP
    IF counted.there <> counted.stated THEN
      RAISE EXCEPTION 'the map has another number of keyframes, points or observations than it says' USING ERRCODE = 'DC004';
    END IF;
  END LOOP;
  IF EXISTS (SELECT 'image/' || k.keyframe FROM docent.keyframes_of(of_map, of_revision) k
             EXCEPT SELECT item FROM docent.items WHERE map = of_map AND revision = of_revision)
     OR (SELECT count(*) FROM docent.items WHERE map = of_map AND revision = of_revision
         AND item LIKE 'image/%') <> new.keyframes THEN
    RAISE EXCEPTION 'the images of the map are not those of its keyframes' USING ERRCODE = 'DC004';
  END IF;
  IF EXISTS (SELECT FROM docent.items i WHERE map = of_map AND revision = of_revision AND item LIKE 'asset/%'
             AND (new.asset_names ->> substr(item, 7)) IS NULL)
     OR (SELECT count(*) FROM jsonb_object_keys(new.asset_names)) <>
        (SELECT count(*) FROM docent.items WHERE map = of_map AND revision = of_revision AND item LIKE 'asset/%') THEN
    RAISE EXCEPTION 'the assets of the map are not those that it names' USING ERRCODE = 'DC004';
  END IF;
END $$;

-- Whether two revisions differ in items whose name fits the pattern.
CREATE FUNCTION docent.differ(of_map uuid, a bigint, b bigint, pattern text) RETURNS boolean STABLE LANGUAGE sql AS $$
  SELECT EXISTS (
    SELECT FROM (SELECT item, blob FROM docent.items WHERE map = of_map AND revision = a AND item ~ pattern) AS old
    FULL JOIN (SELECT item, blob FROM docent.items WHERE map = of_map AND revision = b AND item ~ pattern) AS new
      USING (item) WHERE old.blob IS DISTINCT FROM new.blob)
$$;

-- The items that are the map itself; thumbnails, words and mesh are computed from them.
CREATE FUNCTION docent.structure_items() RETURNS text IMMUTABLE LANGUAGE sql AS
  $$ SELECT '^(cameras|keyframes|points|observations|panoramas|image/.*)$' $$;
CREATE FUNCTION docent.content_items() RETURNS text IMMUTABLE LANGUAGE sql AS $$ SELECT '^(scene|asset/.*)$' $$;

-- Whether the structure of a map changes from one revision to another.
CREATE FUNCTION docent.structure_differs(old docent.revisions, new docent.revisions) RETURNS boolean STABLE LANGUAGE sql AS $$
  SELECT docent.differ(old.map, old.revision, new.revision, docent.structure_items())
    OR (old.next_keyframe, old.next_point, old.map_revision) <> (new.next_keyframe, new.next_point, new.map_revision)
$$;

-- Refuses a new keyframe outside the bounds. Bundle adjustment may move a keyframe slightly after it was accepted
-- inside them, so they are expanded by 5 % of their diagonal, as in a library.
CREATE FUNCTION docent.check_bounds(old docent.revisions, new docent.revisions) RETURNS void LANGUAGE plpgsql AS $$
DECLARE
  slack double precision := 0.05 * sqrt((old.bounds[4] - old.bounds[1]) ^ 2 + (old.bounds[5] - old.bounds[2]) ^ 2
                                        + (old.bounds[6] - old.bounds[3]) ^ 2);
  outside bigint;
BEGIN
  SELECT k.keyframe INTO outside FROM docent.keyframes_of(new.map, new.revision) k
    WHERE k.keyframe NOT IN (SELECT before.keyframe FROM docent.keyframes_of(old.map, old.revision) before)
      AND NOT (k.x BETWEEN old.bounds[1] - slack AND old.bounds[4] + slack
           AND k.y BETWEEN old.bounds[2] - slack AND old.bounds[5] + slack
           AND k.z BETWEEN old.bounds[3] - slack AND old.bounds[6] + slack) LIMIT 1;
  IF outside IS NOT NULL THEN
    RAISE EXCEPTION 'its policy on the hub is bounded, and keyframe % lies outside its bounds', outside
      USING ERRCODE = 'DC002';
  END IF;
END $$;

-- Refuses what the policy of the old revision forbids; maps/storage/policy.h has the table. Only an admin relaxes a
-- policy, and is then bound by the new one.
CREATE FUNCTION docent.check_policy(old docent.revisions, new docent.revisions) RETURNS void LANGUAGE plpgsql AS $$
DECLARE
  relaxed boolean := docent.strictness(new.policy) < docent.strictness(old.policy);
  policy text := CASE WHEN relaxed THEN new.policy ELSE old.policy END;
  refused text;
BEGIN
  IF relaxed THEN
    PERFORM docent.require('admin');
  ELSIF old.policy <> 'open' AND old.bounds IS DISTINCT FROM new.bounds THEN
    RAISE EXCEPTION 'its bounds can only be changed with its policy, by an admin' USING ERRCODE = 'DC002';
  END IF;
  IF policy IN ('augment-only', 'read-only') THEN
    refused := CASE
      WHEN docent.structure_differs(old, new) THEN 'its keyframes and points cannot be changed'
      WHEN docent.differ(old.map, old.revision, new.revision, '^(thumbnails|words)$')
        THEN 'the appearance of its keyframes cannot be changed' END;
  ELSIF policy = 'bounded' AND NOT relaxed THEN
    PERFORM docent.check_bounds(old, new);
  END IF;
  IF policy = 'read-only' THEN
    refused := coalesce(refused, CASE
      WHEN docent.differ(old.map, old.revision, new.revision, docent.content_items())
        OR old.asset_names <> new.asset_names THEN 'its content cannot be changed'
      WHEN docent.differ(old.map, old.revision, new.revision, '^mesh$') THEN 'its mesh cannot be changed'
      WHEN old.name <> new.name THEN 'it cannot be renamed' END);
  END IF;
  IF refused IS NOT NULL THEN
    RAISE EXCEPTION 'its policy on the hub is %, so %', policy, refused USING ERRCODE = 'DC002';
  END IF;
END $$;

-- Forgets the oldest revisions of a map, and bytes that no revision needs. Bytes that were uploaded within a day may
-- belong to a push that is still going on.
CREATE FUNCTION docent.prune(of_map uuid) RETURNS void LANGUAGE plpgsql AS $$
BEGIN
  DELETE FROM docent.revisions r USING docent.maps m, docent.hub h
    WHERE r.map = of_map AND m.id = of_map AND r.revision <= m.revision - h.kept_revisions;
  IF FOUND THEN
    DELETE FROM docent.blobs b WHERE b.used_at < now() - interval '1 day'
      AND NOT EXISTS (SELECT FROM docent.items i WHERE i.blob = b.hash);
  END IF;
END $$;

-- Locks the map and returns its newest revision, which must be `base`; none if base is 0 and there is no such map.
CREATE FUNCTION docent.newest(map_id uuid, base bigint) RETURNS docent.revisions LANGUAGE plpgsql AS $$
DECLARE
  head bigint;
  newest docent.revisions;
BEGIN
  PERFORM FROM docent.hub FOR UPDATE;
  SELECT revision INTO head FROM docent.maps WHERE id = map_id FOR UPDATE;
  IF coalesce(head, 0) <> coalesce(base, -1) THEN
    RAISE EXCEPTION 'the map has another revision on the hub' USING ERRCODE = 'DC001';
  END IF;
  SELECT * INTO newest FROM docent.revisions WHERE map = map_id AND revision = head;
  RETURN newest;
END $$;

-- Makes a revision, whose row and items exist, the newest one.
CREATE FUNCTION docent.publish(new docent.revisions, done text) RETURNS void LANGUAGE plpgsql AS $$
DECLARE
  number bigint := docent.log_change(done, new.map, new.revision, new.name);
BEGIN
  INSERT INTO docent.maps VALUES (new.map, docent.number_of(new.map), new.revision, number, new.name, new.removed)
    ON CONFLICT (id) DO UPDATE SET revision = excluded.revision, change = excluded.change, name = excluded.name,
      removed = excluded.removed;
  PERFORM docent.prune(new.map);
END $$;

-- Checks and publishes the revision `new`, whose items are those of `manifest`, after `old`.
CREATE FUNCTION docent.add_revision(old docent.revisions, new docent.revisions, manifest jsonb, done text)
RETURNS bigint LANGUAGE plpgsql AS $$
BEGIN
  -- Until it is compared, everything counts as changed.
  new.structure_revision := new.revision;
  new.scene_revision := new.revision;
  new.written_by := session_user;
  new.written_at := clock_timestamp();
  IF old.map IS NOT NULL THEN
    IF NOT EXISTS (
        (SELECT key, value FROM jsonb_each_text(manifest) WHERE key ~ docent.structure_items()
         EXCEPT SELECT item, blob FROM docent.items WHERE map = old.map AND revision = old.revision)
        UNION ALL
        (SELECT item, blob FROM docent.items WHERE map = old.map AND revision = old.revision
           AND item ~ docent.structure_items() EXCEPT SELECT key, value FROM jsonb_each_text(manifest))) THEN
      new.structure_revision := old.structure_revision;
    END IF;
    IF (SELECT blob FROM docent.items WHERE map = old.map AND revision = old.revision AND item = 'scene')
       = manifest ->> 'scene' THEN
      new.scene_revision := old.scene_revision;
    END IF;
  END IF;
  INSERT INTO docent.revisions SELECT new.*;
  INSERT INTO docent.items SELECT new.map, new.revision, key, value FROM jsonb_each_text(manifest);
  PERFORM docent.check_parts(new.map, new.revision);
  IF old.map IS NOT NULL AND NOT old.removed THEN
    PERFORM docent.check_policy(old, new);
  END IF;
  PERFORM docent.publish(new, done);
  RETURN new.revision;
END $$;

-- Saves a map as the revision after `base`, 0 for a new map, and returns its number. `facts` has the members of a row of
-- `revisions` that are the map's own; `manifest` gives the hash of each item.
CREATE FUNCTION docent.save_map(map_id uuid, base bigint, facts jsonb, manifest jsonb) RETURNS bigint
LANGUAGE plpgsql SECURITY DEFINER SET search_path = pg_catalog, pg_temp AS $$
DECLARE
  old docent.revisions;
  new docent.revisions;
BEGIN
  PERFORM docent.require('curator');
  old := docent.newest(map_id, base);
  new := jsonb_populate_record(NULL::docent.revisions, facts);
  new.map := map_id;
  new.revision := base + 1;
  new.removed := false;
  RETURN docent.add_revision(old, new, manifest, CASE WHEN base = 0 THEN 'added' ELSE 'saved' END);
END $$;

-- Puts a map back to the state of an earlier revision, as a new one. Its policy and bounds stay.
CREATE FUNCTION docent.revert_map(map_id uuid, base bigint, to_revision bigint) RETURNS bigint
LANGUAGE plpgsql SECURITY DEFINER SET search_path = pg_catalog, pg_temp AS $$
DECLARE
  old docent.revisions;
  new docent.revisions;
  manifest jsonb;
BEGIN
  PERFORM docent.require('curator');
  old := docent.newest(map_id, base);
  SELECT * INTO new FROM docent.revisions WHERE map = map_id AND revision = to_revision;
  IF new.map IS NULL THEN
    RAISE EXCEPTION 'the hub has no revision % of this map any more', to_revision USING ERRCODE = 'DC005';
  END IF;
  SELECT jsonb_object_agg(item, blob) INTO manifest FROM docent.items WHERE map = map_id AND revision = to_revision;
  new.revision := base + 1;
  new.policy := old.policy;
  new.bounds := old.bounds;
  new.removed := false;
  new.modified_ns := (extract(epoch FROM clock_timestamp()) * 1000000000)::bigint;
  RETURN docent.add_revision(old, new, manifest, 'reverted');
END $$;

CREATE FUNCTION docent.remove_map(map_id uuid, base bigint) RETURNS bigint
LANGUAGE plpgsql SECURITY DEFINER SET search_path = pg_catalog, pg_temp AS $$
DECLARE
  new docent.revisions;
BEGIN
  PERFORM docent.require('curator');
  new := docent.newest(map_id, base);
  IF new.map IS NULL THEN
    RAISE EXCEPTION 'the hub has no such map' USING ERRCODE = 'DC005';
  END IF;
  IF new.policy IN ('augment-only', 'read-only') THEN
    RAISE EXCEPTION 'its policy on the hub is %, so it cannot be removed', new.policy USING ERRCODE = 'DC002';
  END IF;
  new.revision := base + 1;
  new.removed := true;
  new.written_by := session_user;
  new.written_at := clock_timestamp();
  INSERT INTO docent.revisions SELECT new.*;
  INSERT INTO docent.items SELECT map, new.revision, item, blob FROM docent.items WHERE map = map_id AND revision = base;
  PERFORM docent.publish(new, 'removed');
  RETURN new.revision;
END $$;

CREATE FUNCTION docent.put_blob(bytes bytea) RETURNS text
LANGUAGE plpgsql SECURITY DEFINER SET search_path = pg_catalog, pg_temp AS $$
DECLARE
  of_bytes text := encode(sha256(bytes), 'hex');
BEGIN
  PERFORM docent.require('curator');
  INSERT INTO docent.blobs VALUES (of_bytes, bytes, now()) ON CONFLICT (hash) DO UPDATE SET used_at = now();
  RETURN of_bytes;
END $$;

-- Those of the hashes that the hub has no bytes for. It keeps the others for a day, so that a push can rely on them.
CREATE FUNCTION docent.missing_blobs(hashes jsonb) RETURNS SETOF text
LANGUAGE plpgsql SECURITY DEFINER SET search_path = pg_catalog, pg_temp AS $$
BEGIN
  PERFORM docent.require('curator');
  UPDATE docent.blobs SET used_at = now() WHERE used_at < now() - interval '1 hour'
    AND hash IN (SELECT jsonb_array_elements_text(hashes));
  RETURN QUERY SELECT DISTINCT wanted FROM jsonb_array_elements_text(hashes) AS wanted
    WHERE NOT EXISTS (SELECT FROM docent.blobs b WHERE b.hash = wanted);
END $$;

-- Adds or changes a tour after the revision `base`, 0 for a new one. Without stops (NULL) it is removed.
CREATE FUNCTION docent.save_tour(tour text, base bigint, of_language text, of_minutes integer, of_stops jsonb) RETURNS bigint
LANGUAGE plpgsql SECURITY DEFINER SET search_path = pg_catalog, pg_temp AS $$
DECLARE
  old docent.tours;
  wanted uuid[];
  done text;
BEGIN
  PERFORM docent.require('curator');
  PERFORM FROM docent.hub FOR UPDATE;
  SELECT * INTO old FROM docent.tours WHERE name = tour FOR UPDATE;
  IF coalesce(old.revision, 0) <> coalesce(base, -1) THEN
    RAISE EXCEPTION 'the tour has another revision on the hub' USING ERRCODE = 'DC001';
  END IF;
  SELECT coalesce(array_agg(stop::uuid ORDER BY place), '{}') INTO wanted
    FROM jsonb_array_elements_text(of_stops) WITH ORDINALITY AS s (stop, place);
  IF EXISTS (SELECT unnest(wanted) EXCEPT SELECT id FROM docent.maps) THEN
    RAISE EXCEPTION 'a stop of the tour is no map of the hub' USING ERRCODE = 'DC004';
  END IF;
  done := CASE WHEN of_stops IS NULL THEN 'removed' WHEN base = 0 THEN 'added' ELSE 'saved' END || ' tour';
  INSERT INTO docent.tours VALUES (tour, base + 1, docent.log_change(done, NULL, base + 1, tour), of_language, of_minutes,
      wanted, of_stops IS NULL)
    ON CONFLICT (name) DO UPDATE SET revision = excluded.revision, change = excluded.change,
      language = excluded.language, minutes = excluded.minutes, stops = excluded.stops, removed = excluded.removed;
  RETURN base + 1;
END $$;

CREATE FUNCTION docent.add_user(new_name text, new_role text) RETURNS void
LANGUAGE plpgsql SECURITY DEFINER SET search_path = pg_catalog, pg_temp AS $$
BEGIN
  PERFORM docent.require('admin');
  IF new_role NOT IN ('visitor', 'curator', 'admin') THEN
    RAISE EXCEPTION 'a role is visitor, curator or admin' USING ERRCODE = 'DC004';
  END IF;
  IF new_name !~ '^[a-z][a-z0-9_-]{0,62}$' OR new_name ~ '^(docent_|pg_)' OR new_name IN ('public', 'none') THEN
    RAISE EXCEPTION 'a user''s name has 1 to 63 small letters, digits, _ and -, begins with a letter, and not with docent_ or pg_'
      USING ERRCODE = 'DC004';
  END IF;
  IF EXISTS (SELECT FROM pg_roles WHERE rolname = new_name) THEN
    RAISE EXCEPTION 'there is already a user ''%'' on this server', new_name USING ERRCODE = 'DC004';
  END IF;
  EXECUTE format('CREATE ROLE %I LOGIN IN ROLE %I', new_name, 'docent_' || new_role);
  INSERT INTO docent.users VALUES (new_name);
  PERFORM docent.log_change('added ' || new_role, NULL, NULL, new_name);
END $$;

-- `verifier` is what a client computes from a password, so that the password itself never reaches the server.
CREATE FUNCTION docent.set_password(of_user text, verifier text) RETURNS void
LANGUAGE plpgsql SECURITY DEFINER SET search_path = pg_catalog, pg_temp AS $$
BEGIN
  IF of_user <> session_user THEN
    PERFORM docent.require('admin');
  END IF;
  IF NOT EXISTS (SELECT FROM docent.users WHERE name = of_user) THEN
    RAISE EXCEPTION 'the hub has no user ''%''', of_user USING ERRCODE = 'DC005';
  END IF;
  IF verifier !~ '^SCRAM-SHA-256\$[0-9]+:[A-Za-z0-9+/=]+\$[A-Za-z0-9+/=]+:[A-Za-z0-9+/=]+$' THEN
    RAISE EXCEPTION 'passwords are stored as SCRAM-SHA-256 only' USING ERRCODE = 'DC004';
  END IF;
  EXECUTE format('ALTER ROLE %I PASSWORD %L', of_user, verifier);
  PERFORM docent.log_change('set password', NULL, NULL, of_user);
END $$;

CREATE FUNCTION docent.remove_user(old_name text) RETURNS void
LANGUAGE plpgsql SECURITY DEFINER SET search_path = pg_catalog, pg_temp AS $$
BEGIN
  PERFORM docent.require('admin');
  DELETE FROM docent.users WHERE name = old_name;
  IF NOT FOUND THEN
    RAISE EXCEPTION 'the hub has no user ''%''', old_name USING ERRCODE = 'DC005';
  END IF;
  EXECUTE format('DROP ROLE %I', old_name);
  PERFORM docent.log_change('removed user', NULL, NULL, old_name);
END $$;

CREATE FUNCTION docent.list_users() RETURNS TABLE (name text, role text)
LANGUAGE sql STABLE SECURITY DEFINER SET search_path = pg_catalog, pg_temp AS $$
  SELECT u.name, CASE WHEN pg_has_role(u.name, 'docent_admin', 'MEMBER') THEN 'admin'
    WHEN pg_has_role(u.name, 'docent_curator', 'MEMBER') THEN 'curator' ELSE 'visitor' END
  FROM docent.users u JOIN pg_roles r ON r.rolname = u.name ORDER BY 1
$$;

-- A function can be called by everyone unless that is revoked.
REVOKE EXECUTE ON ALL FUNCTIONS IN SCHEMA docent FROM PUBLIC;
GRANT USAGE ON SCHEMA docent TO docent_visitor;
GRANT SELECT ON docent.hub, docent.maps, docent.revisions, docent.items, docent.blobs, docent.tours TO docent_visitor;
GRANT SELECT ON docent.changes TO docent_curator;
GRANT EXECUTE ON FUNCTION docent.save_map, docent.revert_map, docent.remove_map, docent.put_blob, docent.missing_blobs,
  docent.save_tour TO docent_curator;
GRANT EXECUTE ON FUNCTION docent.set_password TO docent_visitor;
GRANT EXECUTE ON FUNCTION docent.add_user, docent.remove_user, docent.list_users TO docent_admin;

-- Visitors see the newest revision of maps that were not removed; curators see all.
ALTER TABLE docent.revisions ENABLE ROW LEVEL SECURITY;
ALTER TABLE docent.items ENABLE ROW LEVEL SECURITY;
ALTER TABLE docent.blobs ENABLE ROW LEVEL SECURITY;
CREATE POLICY newest_only ON docent.revisions FOR SELECT TO docent_visitor
  USING (EXISTS (SELECT FROM docent.maps m WHERE m.id = map AND m.revision = revisions.revision AND NOT m.removed));
CREATE POLICY newest_only ON docent.items FOR SELECT TO docent_visitor
  USING (EXISTS (SELECT FROM docent.maps m WHERE m.id = map AND m.revision = items.revision AND NOT m.removed));
CREATE POLICY newest_only ON docent.blobs FOR SELECT TO docent_visitor
  USING (EXISTS (SELECT FROM docent.items i WHERE i.blob = hash));
CREATE POLICY everything ON docent.revisions FOR SELECT TO docent_curator USING (true);
CREATE POLICY everything ON docent.items FOR SELECT TO docent_curator USING (true);
CREATE POLICY everything ON docent.blobs FOR SELECT TO docent_curator USING (true);
