-- SPDX-License-Identifier: Apache-2.0
-- Version 2: records of visits, which devices hand in (docs/hub.md). Never edit it, as version 1.

-- A line of a file visits-DAY.jsonl of a device.
CREATE TABLE docent.visits (
  hash text PRIMARY KEY CHECK (hash = encode(sha256(convert_to(line, 'UTF8')), 'hex')),
  day date NOT NULL,
  line text NOT NULL CHECK (octet_length(line) BETWEEN 2 AND 1048576 AND line !~ '[\x01-\x1f\x7f]'
    AND jsonb_typeof(line::jsonb) = 'object'),
  handed_in_by text NOT NULL,
  handed_in_at timestamptz NOT NULL
);
CREATE INDEX visits_day ON docent.visits (day);

-- Adds those of the records [{"day": DAY, "line": LINE}, ...] that are not there, and returns their number, so that
-- nothing is counted twice when a device hands in a file again.
CREATE FUNCTION docent.hand_in_visits(records jsonb) RETURNS bigint
LANGUAGE plpgsql SECURITY DEFINER SET search_path = pg_catalog, pg_temp AS $$
DECLARE
  added bigint;
BEGIN
  PERFORM docent.require('visitor');
  INSERT INTO docent.visits
    SELECT encode(sha256(convert_to(r ->> 'line', 'UTF8')), 'hex'), (r ->> 'day')::date, r ->> 'line', session_user, now()
    FROM jsonb_array_elements(records) AS r ON CONFLICT (hash) DO NOTHING;
  GET DIAGNOSTICS added = ROW_COUNT;
  RETURN added;
END $$;

REVOKE EXECUTE ON FUNCTION docent.hand_in_visits FROM PUBLIC;
GRANT EXECUTE ON FUNCTION docent.hand_in_visits TO docent_visitor;
GRANT SELECT ON docent.visits TO docent_curator;

UPDATE docent.hub SET version = 2;
